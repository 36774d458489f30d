/* The functions of FMI 3.0 for model exchange and co-simulation of a unit of unit.h. Its types are declared here. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

#ifndef fmi3FunctionTypes_h
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(void *environment, fmi3Status status, const char *category, const char *text);
typedef void (*fmi3ClockUpdateCallback)(void *environment);
typedef void (*fmi3IntermediateUpdateCallback)(
    void *environment, double time, bool set_requested, bool get_allowed, bool step_finished, bool can_return,
    bool *return_requested, double *return_time);
typedef void (*fmi3LockPreemptionCallback)();
typedef void (*fmi3UnlockPreemptionCallback)();
#endif

typedef struct {
    Memory unit;
    void *environment;
    fmi3LogMessageCallback log;
} Instance;

#define UNIT(c) (&((Instance *)(c))->unit)
#define REFERENCES const uint32_t reference[], size_t n

static fmi3Status told(void *c, const char *words, fmi3Status status)
{
    const Instance *instance = c;
    if (instance->log) instance->log(instance->environment, status, "logStatusError", words);
    return status;
}

static fmi3Status answer(void *c, Outcome outcome)
{
    return outcome == UNIT_OK ? fmi3OK : told(c, unit_words[outcome], fmi3Error);
}

static void *instance_of(const char *token, void *environment, fmi3LogMessageCallback log)
{
    Instance *instance = calloc(1, sizeof *instance);
    if (!instance) return NULL;
    instance->environment = environment;
    instance->log = log;
    if (strcmp(token, TOKEN) != 0) {
        told(instance, "the instantiation token is not that of modelDescription.xml", fmi3Error);
        free(instance);
        return NULL;
    }
    unit_reset(&instance->unit);
    return instance;
}

EXPORTED const char *fmi3GetVersion(void) { return "3.0"; }

EXPORTED fmi3Status fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi3OK;
}

EXPORTED void *fmi3InstantiateModelExchange(
    const char *name, const char *token, const char *resources, bool visible, bool logging, void *environment,
    fmi3LogMessageCallback log)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    return instance_of(token, environment, log);
}

EXPORTED void *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *resources, bool visible, bool logging, bool event_mode,
    bool early_return, const uint32_t intermediate[], size_t n_intermediate, void *environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early_return;
    (void)intermediate, (void)n_intermediate, (void)update;
    return instance_of(token, environment, log);
}

EXPORTED void *fmi3InstantiateScheduledExecution(
    const char *name, const char *token, const char *resources, bool visible, bool logging, void *environment,
    fmi3LogMessageCallback log, fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log) log(environment, fmi3Error, "logStatusError", "it is no unit for scheduled execution");
    return NULL;
}

EXPORTED void fmi3FreeInstance(void *c) { free(c); }

EXPORTED fmi3Status fmi3EnterInitializationMode(
    void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    UNIT(c)->value[AT_TIME] = start;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3ExitInitializationMode(void *c) { return answer(c, unit_derivatives(UNIT(c), NULL)); }
EXPORTED fmi3Status fmi3EnterEventMode(void *c) { (void)c; return fmi3OK; }
EXPORTED fmi3Status fmi3Terminate(void *c) { (void)c; return fmi3OK; }
EXPORTED fmi3Status fmi3Reset(void *c) { unit_reset(UNIT(c)); return fmi3OK; }

EXPORTED fmi3Status fmi3GetFloat64(void *c, REFERENCES, double values[], size_t n_values)
{
    return answer(c, n == n_values ? unit_get(UNIT(c), reference, n, values) : UNIT_UNKNOWN);
}

EXPORTED fmi3Status fmi3SetFloat64(void *c, REFERENCES, const double values[], size_t n_values)
{
    return answer(c, n == n_values ? unit_set(UNIT(c), reference, n, values) : UNIT_UNKNOWN);
}

/* All variables have the type Float64. */
#define NO_VARIABLES(TYPE, C_TYPE, C_CONST)                                                                            \
    EXPORTED fmi3Status fmi3Get##TYPE(void *c, REFERENCES, C_TYPE values[], size_t n_values)                           \
    {                                                                                                                  \
        (void)reference, (void)values, (void)n_values;                                                                 \
        return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;                                                                   \
    }                                                                                                                  \
    EXPORTED fmi3Status fmi3Set##TYPE(void *c, REFERENCES, C_CONST values[], size_t n_values)                          \
    {                                                                                                                  \
        (void)reference, (void)values, (void)n_values;                                                                 \
        return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;                                                                   \
    }
NO_VARIABLES(Float32, float, const float)
NO_VARIABLES(Int8, int8_t, const int8_t)
NO_VARIABLES(UInt8, uint8_t, const uint8_t)
NO_VARIABLES(Int16, int16_t, const int16_t)
NO_VARIABLES(UInt16, uint16_t, const uint16_t)
NO_VARIABLES(Int32, int32_t, const int32_t)
NO_VARIABLES(UInt32, uint32_t, const uint32_t)
NO_VARIABLES(Int64, int64_t, const int64_t)
NO_VARIABLES(UInt64, uint64_t, const uint64_t)
NO_VARIABLES(Boolean, bool, const bool)
NO_VARIABLES(String, const char *, const char *const)

EXPORTED fmi3Status fmi3GetBinary(void *c, REFERENCES, size_t sizes[], const uint8_t *values[], size_t n_values)
{
    (void)reference, (void)sizes, (void)values, (void)n_values;
    return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;
}

EXPORTED fmi3Status fmi3SetBinary(
    void *c, REFERENCES, const size_t sizes[], const uint8_t *const values[], size_t n_values)
{
    (void)reference, (void)sizes, (void)values, (void)n_values;
    return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;
}

EXPORTED fmi3Status fmi3GetClock(void *c, REFERENCES, bool values[])
{
    (void)reference, (void)values;
    return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;
}

EXPORTED fmi3Status fmi3SetClock(void *c, REFERENCES, const bool values[])
{
    (void)reference, (void)values;
    return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfVariableDependencies(void *c, uint32_t reference, size_t *n)
{
    (void)reference, (void)n;
    return told(c, "dependencies are those of modelDescription.xml", fmi3Error);
}

EXPORTED fmi3Status fmi3GetVariableDependencies(
    void *c, uint32_t dependent, size_t of_dependent[], uint32_t independents[], size_t of_independents[],
    fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent, (void)of_dependent, (void)independents, (void)of_independents, (void)kinds, (void)n;
    return told(c, "dependencies are those of modelDescription.xml", fmi3Error);
}

EXPORTED fmi3Status fmi3GetFMUState(void *c, void **state)
{
    if (!*state) *state = malloc(sizeof(Memory));
    if (!*state) return told(c, "no memory for a state", fmi3Error);
    memcpy(*state, UNIT(c), sizeof(Memory));
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetFMUState(void *c, void *state)
{
    memcpy(UNIT(c), state, sizeof(Memory));
    return fmi3OK;
}

EXPORTED fmi3Status fmi3FreeFMUState(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SerializedFMUStateSize(void *c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Memory);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SerializeFMUState(void *c, void *state, uint8_t bytes[], size_t size)
{
    if (size < sizeof(Memory)) return told(c, "too few bytes for a state", fmi3Error);
    memcpy(bytes, state, sizeof(Memory));
    return fmi3OK;
}

EXPORTED fmi3Status fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **state)
{
    if (size != sizeof(Memory)) return told(c, "these bytes are no state of this unit", fmi3Error);
    if (!*state) *state = malloc(sizeof(Memory));
    if (!*state) return told(c, "no memory for a state", fmi3Error);
    memcpy(*state, bytes, sizeof(Memory));
    return fmi3OK;
}

/* Functions that the unit does not support */
#define NO_DERIVATIVE(NAME)                                                                                            \
    EXPORTED fmi3Status NAME(                                                                                          \
        void *c, const uint32_t unknowns[], size_t n_unknown, const uint32_t knowns[], size_t n_known,                 \
        const double seed[], size_t n_seed, double result[], size_t n_result)                                          \
    {                                                                                                                  \
        (void)unknowns, (void)n_unknown, (void)knowns, (void)n_known, (void)seed, (void)n_seed;                        \
        (void)result, (void)n_result;                                                                                  \
        return told(c, "it has no directional derivatives", fmi3Error);                                                \
    }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

#define NO_CLOCKS(NAME, ...)                                                                                           \
    EXPORTED fmi3Status NAME(void *c, REFERENCES, __VA_ARGS__)                                                         \
    {                                                                                                                  \
        (void)reference, (void)n, (void)first, NO_CLOCKS_USED;                                                         \
        return told(c, "it has no clocks", fmi3Error);                                                                 \
    }
#define NO_CLOCKS_USED (void)0
NO_CLOCKS(fmi3GetShiftDecimal, double first[])
NO_CLOCKS(fmi3SetIntervalDecimal, const double first[])
NO_CLOCKS(fmi3SetShiftDecimal, const double first[])
#undef NO_CLOCKS_USED
#define NO_CLOCKS_USED (void)second
NO_CLOCKS(fmi3GetIntervalDecimal, double first[], fmi3IntervalQualifier second[])
NO_CLOCKS(fmi3GetShiftFraction, uint64_t first[], uint64_t second[])
NO_CLOCKS(fmi3SetIntervalFraction, const uint64_t first[], const uint64_t second[])
NO_CLOCKS(fmi3SetShiftFraction, const uint64_t first[], const uint64_t second[])
#undef NO_CLOCKS_USED
#define NO_CLOCKS_USED (void)second, (void)third
NO_CLOCKS(fmi3GetIntervalFraction, uint64_t first[], uint64_t second[], fmi3IntervalQualifier third[])

EXPORTED fmi3Status fmi3ActivateModelPartition(void *c, uint32_t reference, double time)
{
    (void)reference, (void)time;
    return told(c, "it has no clocks", fmi3Error);
}

EXPORTED fmi3Status fmi3EnterConfigurationMode(void *c) { (void)c; return fmi3OK; }
EXPORTED fmi3Status fmi3ExitConfigurationMode(void *c) { (void)c; return fmi3OK; }
EXPORTED fmi3Status fmi3EvaluateDiscreteStates(void *c) { (void)c; return fmi3OK; }

EXPORTED fmi3Status fmi3UpdateDiscreteStates(
    void *c, bool *again, bool *terminate, bool *nominals_changed, bool *values_changed, bool *has_next, double *next)
{
    (void)c;
    *again = *terminate = *nominals_changed = *values_changed = *has_next = false;
    *next = 0.0;
    return fmi3OK;
}

/* Model exchange */

EXPORTED fmi3Status fmi3EnterContinuousTimeMode(void *c) { (void)c; return fmi3OK; }

EXPORTED fmi3Status fmi3CompletedIntegratorStep(void *c, bool no_way_back, bool *enter_event, bool *terminate)
{
    (void)c, (void)no_way_back;
    *enter_event = *terminate = false;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetTime(void *c, double time)
{
    UNIT(c)->value[AT_TIME] = time;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3SetContinuousStates(void *c, const double x[], size_t n)
{
    return answer(c, unit_set_states(UNIT(c), x, n));
}

EXPORTED fmi3Status fmi3GetContinuousStateDerivatives(void *c, double x_dot[], size_t n)
{
    return answer(c, n == N_STATES ? unit_derivatives(UNIT(c), x_dot) : UNIT_UNKNOWN);
}

EXPORTED fmi3Status fmi3GetEventIndicators(void *c, double indicators[], size_t n)
{
    (void)indicators;
    return n ? answer(c, UNIT_UNKNOWN) : fmi3OK;
}

EXPORTED fmi3Status fmi3GetContinuousStates(void *c, double x[], size_t n)
{
    if (n != N_STATES) return answer(c, UNIT_UNKNOWN);
    memcpy(x, UNIT(c)->value + AT_Z, n * sizeof *x);
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNominalsOfContinuousStates(void *c, double nominals[], size_t n)
{
    if (n != N_STATES) return answer(c, UNIT_UNKNOWN);
    for (size_t k = 0; k < n; k++) nominals[k] = 1.0;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfEventIndicators(void *c, size_t *n)
{
    (void)c;
    *n = 0;
    return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfContinuousStates(void *c, size_t *n)
{
    (void)c;
    *n = N_STATES;
    return fmi3OK;
}

/* Co-simulation */

EXPORTED fmi3Status fmi3EnterStepMode(void *c) { (void)c; return fmi3OK; }

EXPORTED fmi3Status fmi3GetOutputDerivatives(void *c, REFERENCES, const int32_t orders[], double values[], size_t n_values)
{
    (void)reference, (void)orders, (void)values, (void)n_values;
    return n ? told(c, "it has no derivatives of outputs", fmi3Error) : fmi3OK;
}

EXPORTED fmi3Status fmi3DoStep(
    void *c, double t, double size, bool no_way_back, bool *event, bool *terminate, bool *early, double *reached)
{
    (void)no_way_back;
    UNIT(c)->value[AT_TIME] = t;
    const Outcome outcome = unit_step(UNIT(c), size);
    *event = *terminate = *early = false;
    *reached = UNIT(c)->value[AT_TIME];
    return outcome == UNIT_OK ? fmi3OK : told(c, unit_words[outcome], fmi3Discard);
}
