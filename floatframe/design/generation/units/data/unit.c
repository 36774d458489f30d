/*
 * Derivatives from the generated forward dynamics, and steps by the classical Runge-Kutta method of order four.
 *
 * The derivatives of positions are their rates, except for Euler parameters p, whose derivative is p (0, omega) / 2. The
 * generated equations need p of length one: they receive p / |p|, and p is normalised after each step.
 */
#define UNIT_C
#include "unit.h"

#include <math.h>
#include <string.h>

const char *const unit_words[] = {
    "",
    "there is no real variable of this value reference",
    "a derivative cannot be set",
    "values that are not finite: a step too long, forces too large, or a position without inertia",
    "expected a step above 0",
};

static void make_unit(double *p)
{
    const double length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
    for (int i = 0; i < 4; i++) p[i] /= length;
}

static void make_units(double *z)
{
    for (int k = 0; k < N_TURNS; k++) make_unit(z + turns[k][0]);
}

/* Derivatives of the states x = (z, v) by time in seconds, x_dot. */
static Outcome change(const double *x, const double *force, const double *parameters, double *x_dot)
{
    double z[N_Z], a[N_V];
    const double *v = x + N_Z;
    (void)parameters;
    memcpy(z, x, sizeof z);
    make_units(z);
    ACCELERATIONS(z, v, force, parameters, a);
    for (int k = 0; k < N_SLIDES; k++) x_dot[slides[k][0]] = v[slides[k][1]] / SECONDS;
    for (int k = 0; k < N_TURNS; k++) {
        const double *p = x + turns[k][0], *w = v + turns[k][1];
        double *p_dot = x_dot + turns[k][0];
        p_dot[0] = 0.5 * (-p[1] * w[0] - p[2] * w[1] - p[3] * w[2]) / SECONDS;
        p_dot[1] = 0.5 * (p[0] * w[0] + p[2] * w[2] - p[3] * w[1]) / SECONDS;
        p_dot[2] = 0.5 * (p[0] * w[1] + p[3] * w[0] - p[1] * w[2]) / SECONDS;
        p_dot[3] = 0.5 * (p[0] * w[2] + p[1] * w[1] - p[2] * w[0]) / SECONDS;
    }
    for (int k = 0; k < N_V; k++) x_dot[N_Z + k] = a[k] / SECONDS;
    for (int k = 0; k < N_STATES; k++)
        if (!isfinite(x_dot[k])) return UNIT_NOT_FINITE;
    return UNIT_OK;
}

void unit_reset(Memory *unit)
{
    memset(unit, 0, sizeof *unit);
    memcpy(unit->value, start_values, sizeof start_values);
}

Outcome unit_derivatives(Memory *unit, double *x_dot)
{
    double *value = unit->value;
    if (!unit->is_fresh) {
        const Outcome outcome = change(value + AT_Z, value + AT_FORCE, value + AT_PARAMETER, value + AT_Z_DOT);
        if (outcome != UNIT_OK) return outcome;
        unit->is_fresh = 1;
    }
    if (x_dot) memcpy(x_dot, value + AT_Z_DOT, N_STATES * sizeof *x_dot);
    return UNIT_OK;
}

Outcome unit_get(Memory *unit, const unsigned int *reference, size_t n, double *value)
{
    for (size_t k = 0; k < n; k++) {
        if (reference[k] >= N_VALUES) return UNIT_UNKNOWN;
        if (reference[k] >= AT_Z_DOT) {
            const Outcome outcome = unit_derivatives(unit, NULL);
            if (outcome != UNIT_OK) return outcome;
        }
        value[k] = unit->value[reference[k]];
    }
    return UNIT_OK;
}

Outcome unit_set(Memory *unit, const unsigned int *reference, size_t n, const double *value)
{
    for (size_t k = 0; k < n; k++) {
        if (reference[k] >= N_VALUES || reference[k] == AT_TIME) return UNIT_UNKNOWN;
        if (reference[k] >= AT_Z_DOT) return UNIT_READ_ONLY;
        if (!isfinite(value[k])) return UNIT_NOT_FINITE;
        if (reference[k] == AT_STEP && value[k] <= 0.0) return UNIT_NO_STEP;
    }
    for (size_t k = 0; k < n; k++) unit->value[reference[k]] = value[k];
    unit->is_fresh = 0;
    return UNIT_OK;
}

Outcome unit_set_states(Memory *unit, const double *x, size_t n)
{
    if (n != N_STATES) return UNIT_UNKNOWN;
    memcpy(unit->value + AT_Z, x, n * sizeof *x);
    unit->is_fresh = 0;
    return UNIT_OK;
}

/* One communication step with constant inputs, in equal steps of at most the longest step; a failure changes nothing. */
Outcome unit_step(Memory *unit, double size)
{
    static const double part[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    const double *force = unit->value + AT_FORCE, *parameters = unit->value + AT_PARAMETER;
    double x[N_STATES], sum[N_STATES], at[N_STATES], x_dot[N_STATES];
    if (!(size > 0.0) || !isfinite(size)) return UNIT_NO_STEP;
    const double n = fmax(1.0, ceil(size / unit->value[AT_STEP] * (1.0 - 1e-9))), h = size / n;
    memcpy(x, unit->value + AT_Z, sizeof x);
    for (double step = 0.0; step < n; step += 1.0) {
        memcpy(sum, x, sizeof sum);
        for (int stage = 0; stage < 4; stage++) {
            for (int k = 0; k < N_STATES; k++) at[k] = stage ? x[k] + part[stage] * h * x_dot[k] : x[k];
            const Outcome outcome = change(at, force, parameters, x_dot);
            if (outcome != UNIT_OK) return outcome;
            for (int k = 0; k < N_STATES; k++) sum[k] += weight[stage] * h * x_dot[k];
        }
        memcpy(x, sum, sizeof x);
        make_units(x);
    }
    memcpy(unit->value + AT_Z, x, sizeof x);
    unit->value[AT_TIME] += size;
    unit->is_fresh = 0;
    return UNIT_OK;
}
