/* A generated system as a unit: its values by reference, its derivatives, and steps of its own. */
#ifndef UNIT_H
#define UNIT_H

#include <stddef.h>

#include "model.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

/* Value references: time, positions, rates, forces, parameters, the longest step, derivatives of positions and rates. */
enum {
    AT_TIME = 0,
    AT_Z = 1,
    AT_V = AT_Z + N_Z,
    AT_FORCE = AT_V + N_V,
    AT_PARAMETER = AT_FORCE + N_V,
    AT_STEP = AT_PARAMETER + N_P,
    AT_Z_DOT = AT_STEP + 1,
    AT_V_DOT = AT_Z_DOT + N_Z,
    N_VALUES = AT_V_DOT + N_V,
    N_STATES = N_Z + N_V
};

typedef struct {
    double value[N_VALUES]; /* all variables, by value reference */
    int is_fresh;           /* whether the derivatives belong to the other values */
} Memory;

typedef enum { UNIT_OK, UNIT_UNKNOWN, UNIT_READ_ONLY, UNIT_NOT_FINITE, UNIT_NO_STEP } Outcome;

extern const char *const unit_words[]; /* message of each outcome */

void unit_reset(Memory *unit);
Outcome unit_get(Memory *unit, const unsigned int *reference, size_t n, double *value);
Outcome unit_set(Memory *unit, const unsigned int *reference, size_t n, const double *value);
Outcome unit_derivatives(Memory *unit, double *x_dot);
Outcome unit_set_states(Memory *unit, const double *x, size_t n);
Outcome unit_step(Memory *unit, double size);

#endif
