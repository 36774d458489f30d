/* The functions of FMI 2.0 for model exchange and co-simulation of a unit of unit.h. Its types are declared here. */
#include <stdlib.h>
#include <string.h>

#include "unit.h"

#ifndef fmi2FunctionTypes_h
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(void *environment, const char *name, fmi2Status status, const char *category, const char *text, ...);
    void *(*allocateMemory)(size_t n, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(void *environment, fmi2Status status);
    void *componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    int newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged,
        nextEventTimeDefined;
    double nextEventTime;
} fmi2EventInfo;
#endif

typedef struct {
    Memory unit;
    const fmi2CallbackFunctions *callbacks;
    char *name;
} Instance;

#define UNIT(c) (&((Instance *)(c))->unit)
#define REFERENCES const unsigned int *reference, size_t n

static fmi2Status told(void *c, const char *category, const char *words, fmi2Status status)
{
    const Instance *instance = c;
    if (instance->callbacks && instance->callbacks->logger)
        instance->callbacks->logger(
            instance->callbacks->componentEnvironment, instance->name, status, category, "%s", words);
    return status;
}

static fmi2Status answer(void *c, Outcome outcome)
{
    return outcome == UNIT_OK ? fmi2OK : told(c, "logStatusError", unit_words[outcome], fmi2Error);
}

EXPORTED const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }

EXPORTED fmi2Status fmi2SetDebugLogging(void *c, int on, size_t n, const char *const categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return fmi2OK;
}

EXPORTED void *fmi2Instantiate(
    const char *name, fmi2Type type, const char *token, const char *resources, const fmi2CallbackFunctions *callbacks,
    int visible, int logging)
{
    (void)type, (void)resources, (void)visible, (void)logging;
    Instance *instance = calloc(1, sizeof *instance);
    if (!instance) return NULL;
    instance->callbacks = callbacks;
    instance->name = calloc(strlen(name) + 1, 1);
    if (!instance->name || strcmp(token, TOKEN) != 0) {
        if (instance->name) {
            strcpy(instance->name, name);
            told(instance, "logStatusError", "the guid is not that of modelDescription.xml", fmi2Error);
        }
        free(instance->name);
        free(instance);
        return NULL;
    }
    strcpy(instance->name, name);
    unit_reset(&instance->unit);
    return instance;
}

EXPORTED void fmi2FreeInstance(void *c)
{
    if (!c) return;
    free(((Instance *)c)->name);
    free(c);
}

EXPORTED fmi2Status fmi2SetupExperiment(
    void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    UNIT(c)->value[AT_TIME] = start;
    return fmi2OK;
}

EXPORTED fmi2Status fmi2EnterInitializationMode(void *c) { (void)c; return fmi2OK; }
EXPORTED fmi2Status fmi2ExitInitializationMode(void *c) { return answer(c, unit_derivatives(UNIT(c), NULL)); }
EXPORTED fmi2Status fmi2Terminate(void *c) { (void)c; return fmi2OK; }
EXPORTED fmi2Status fmi2Reset(void *c) { unit_reset(UNIT(c)); return fmi2OK; }

EXPORTED fmi2Status fmi2GetReal(void *c, REFERENCES, double *value)
{
    return answer(c, unit_get(UNIT(c), reference, n, value));
}

EXPORTED fmi2Status fmi2SetReal(void *c, REFERENCES, const double *value)
{
    return answer(c, unit_set(UNIT(c), reference, n, value));
}

/* All variables are real. */
#define NO_VARIABLES(NAME, TYPE)                                                                                       \
    EXPORTED fmi2Status NAME(void *c, REFERENCES, TYPE value[])                                                        \
    {                                                                                                                  \
        (void)reference, (void)value;                                                                                  \
        return n ? answer(c, UNIT_UNKNOWN) : fmi2OK;                                                                   \
    }
NO_VARIABLES(fmi2GetInteger, int)
NO_VARIABLES(fmi2GetBoolean, int)
NO_VARIABLES(fmi2GetString, const char *)
NO_VARIABLES(fmi2SetInteger, const int)
NO_VARIABLES(fmi2SetBoolean, const int)
NO_VARIABLES(fmi2SetString, const char *const)

EXPORTED fmi2Status fmi2GetFMUstate(void *c, void **state)
{
    if (!*state) *state = malloc(sizeof(Memory));
    if (!*state) return told(c, "logStatusError", "no memory for a state", fmi2Error);
    memcpy(*state, UNIT(c), sizeof(Memory));
    return fmi2OK;
}

EXPORTED fmi2Status fmi2SetFMUstate(void *c, void *state)
{
    memcpy(UNIT(c), state, sizeof(Memory));
    return fmi2OK;
}

EXPORTED fmi2Status fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

EXPORTED fmi2Status fmi2SerializedFMUstateSize(void *c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Memory);
    return fmi2OK;
}

EXPORTED fmi2Status fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t size)
{
    if (size < sizeof(Memory)) return told(c, "logStatusError", "too few bytes for a state", fmi2Error);
    memcpy(bytes, state, sizeof(Memory));
    return fmi2OK;
}

EXPORTED fmi2Status fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **state)
{
    if (size != sizeof(Memory)) return told(c, "logStatusError", "these bytes are no state of this unit", fmi2Error);
    if (!*state) *state = malloc(sizeof(Memory));
    if (!*state) return told(c, "logStatusError", "no memory for a state", fmi2Error);
    memcpy(*state, bytes, sizeof(Memory));
    return fmi2OK;
}

EXPORTED fmi2Status fmi2GetDirectionalDerivative(
    void *c, const unsigned int unknown[], size_t n_unknown, const unsigned int known[], size_t n_known,
    const double change[], double result[])
{
    (void)unknown, (void)n_unknown, (void)known, (void)n_known, (void)change, (void)result;
    return told(c, "logStatusError", "it has no directional derivatives", fmi2Error);
}

/* Model exchange */

EXPORTED fmi2Status fmi2EnterEventMode(void *c) { (void)c; return fmi2OK; }
EXPORTED fmi2Status fmi2EnterContinuousTimeMode(void *c) { (void)c; return fmi2OK; }

EXPORTED fmi2Status fmi2NewDiscreteStates(void *c, fmi2EventInfo *info)
{
    (void)c;
    memset(info, 0, sizeof *info);
    return fmi2OK;
}

EXPORTED fmi2Status fmi2CompletedIntegratorStep(void *c, int no_way_back, int *enter_event, int *terminate)
{
    (void)c, (void)no_way_back;
    *enter_event = *terminate = 0;
    return fmi2OK;
}

EXPORTED fmi2Status fmi2SetTime(void *c, double time)
{
    UNIT(c)->value[AT_TIME] = time;
    return fmi2OK;
}

EXPORTED fmi2Status fmi2SetContinuousStates(void *c, const double x[], size_t n)
{
    return answer(c, unit_set_states(UNIT(c), x, n));
}

EXPORTED fmi2Status fmi2GetDerivatives(void *c, double x_dot[], size_t n)
{
    return answer(c, n == N_STATES ? unit_derivatives(UNIT(c), x_dot) : UNIT_UNKNOWN);
}

EXPORTED fmi2Status fmi2GetEventIndicators(void *c, double indicators[], size_t n)
{
    (void)indicators;
    return n ? answer(c, UNIT_UNKNOWN) : fmi2OK;
}

EXPORTED fmi2Status fmi2GetContinuousStates(void *c, double x[], size_t n)
{
    if (n != N_STATES) return answer(c, UNIT_UNKNOWN);
    memcpy(x, UNIT(c)->value + AT_Z, n * sizeof *x);
    return fmi2OK;
}

EXPORTED fmi2Status fmi2GetNominalsOfContinuousStates(void *c, double nominal[], size_t n)
{
    if (n != N_STATES) return answer(c, UNIT_UNKNOWN);
    for (size_t k = 0; k < n; k++) nominal[k] = 1.0;
    return fmi2OK;
}

/* Co-simulation */

EXPORTED fmi2Status fmi2SetRealInputDerivatives(void *c, REFERENCES, const int order[], const double value[])
{
    (void)reference, (void)order, (void)value;
    return n ? told(c, "logStatusError", "inputs are held over a step", fmi2Error) : fmi2OK;
}

EXPORTED fmi2Status fmi2GetRealOutputDerivatives(void *c, REFERENCES, const int order[], double value[])
{
    (void)reference, (void)order, (void)value;
    return n ? told(c, "logStatusError", "it has no derivatives of outputs", fmi2Error) : fmi2OK;
}

EXPORTED fmi2Status fmi2DoStep(void *c, double t, double size, int no_way_back)
{
    (void)no_way_back;
    UNIT(c)->value[AT_TIME] = t;
    const Outcome outcome = unit_step(UNIT(c), size);
    return outcome == UNIT_OK ? fmi2OK : told(c, "logStatusError", unit_words[outcome], fmi2Discard);
}

EXPORTED fmi2Status fmi2CancelStep(void *c) { return told(c, "logStatusError", "no step is under way", fmi2Error); }

EXPORTED fmi2Status fmi2GetStatus(void *c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

EXPORTED fmi2Status fmi2GetRealStatus(void *c, const fmi2StatusKind kind, double *value)
{
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = UNIT(c)->value[AT_TIME];
    return fmi2OK;
}

EXPORTED fmi2Status fmi2GetIntegerStatus(void *c, const fmi2StatusKind kind, int *value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}

EXPORTED fmi2Status fmi2GetBooleanStatus(void *c, const fmi2StatusKind kind, int *value)
{
    (void)c;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = 0;
    return fmi2OK;
}

EXPORTED fmi2Status fmi2GetStringStatus(void *c, const fmi2StatusKind kind, const char **value)
{
    (void)c, (void)kind, (void)value;
    return fmi2Discard;
}
