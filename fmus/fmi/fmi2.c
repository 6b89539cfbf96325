/* FMI 2.0 for co-simulation on top of instance.c. Functions for features that no model here has (integers, strings,
 * derivatives, asynchronous steps) report an error that names the feature. Memory comes from the C library, as FMI 2.0
 * permits. */
#include "fmi2.h"

#include <stdlib.h>

/* Pass `message` to the host's logger, which takes a printf format: as the format itself, every % doubled, so that a
 * host that cannot expand variadic arguments shows it too. */
static void say(const Instance *self, Status status, const char *message)
{
    char format[1024];
    size_t n = 0;
    for (; *message && n < sizeof format - 2; message++) {
        if (*message == '%')
            format[n++] = '%';
        format[n++] = *message;
    }
    format[n] = '\0';
    ((fmi2Logger)self->logger)(self->environment, self->name, (fmi2Status)status, "logStatusError", format);
}

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    (void)c, (void)on, (void)n, (void)categories; /* there are no debug messages; errors are always reported */
    return STATUS_OK;
}

fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on)
{
    (void)resources, (void)visible, (void)logging_on;
    Instance *self = instance_new(name, guid, say, functions ? (void (*)(void))functions->logger : NULL,
                                  functions ? functions->environment : NULL);
    if (self && type != FMI2_CO_SIMULATION) {
        instance_fail(self, "this FMU offers co-simulation only");
        instance_free(self);
        return NULL;
    }
    return self;
}

void fmi2FreeInstance(fmi2Component c) { instance_free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean stop_time_defined, fmi2Real stop_time)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_time_defined, (void)stop_time;
    return instance_start_time(c, start_time);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return instance_enter_initialization(c); }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return instance_exit_initialization(c); }

fmi2Status fmi2Terminate(fmi2Component c) { return instance_terminate(c); }

fmi2Status fmi2Reset(fmi2Component c) { return instance_reset(c); }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2Real values[])
{
    return instance_get(c, references, n, values);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t n, const fmi2Real values[])
{
    return instance_set(c, references, n, values);
}

#define NO_VARIABLES_OF(TYPE)                                                                                          \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t n, fmi2##TYPE values[])    \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return n == 0 ? STATUS_OK : instance_fail(c, "this FMU has no variables of type " #TYPE);                      \
    }                                                                                                                  \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t n,                         \
                             const fmi2##TYPE values[])                                                                \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return n == 0 ? STATUS_OK : instance_fail(c, "this FMU has no variables of type " #TYPE);                      \
    }

NO_VARIABLES_OF(Integer)
NO_VARIABLES_OF(Boolean)
NO_VARIABLES_OF(String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return instance_save(c, state); }

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return instance_restore(c, state); }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return STATUS_OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(State);
    return STATUS_OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return instance_serialize(c, state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return instance_deserialize(c, bytes, size, state);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    (void)unknowns, (void)n_unknowns, (void)knowns, (void)n_knowns, (void)seed, (void)sensitivity;
    return instance_fail(c, "this FMU offers no directional derivatives");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                       const fmi2Integer orders[], const fmi2Real values[])
{
    (void)references, (void)n, (void)orders, (void)values;
    return instance_fail(c, "this FMU holds its inputs over a step: it takes no input derivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[], size_t n,
                                        const fmi2Integer orders[], fmi2Real values[])
{
    (void)references, (void)n, (void)orders, (void)values;
    return instance_fail(c, "this FMU offers no output derivatives");
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean no_set_state_prior)
{
    (void)no_set_state_prior;
    return instance_step(c, time, h);
}

fmi2Status fmi2CancelStep(fmi2Component c) { return instance_fail(c, "no step runs asynchronously"); }

fmi2Status fmi2GetStatus(fmi2Component c, int kind, fmi2Status *value)
{
    (void)kind, (void)value;
    return instance_fail(c, "no step runs asynchronously");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, int kind, fmi2Real *value)
{
    if (kind != FMI2_LAST_SUCCESSFUL_TIME)
        return instance_fail(c, "status %d is not a real number", kind);
    *value = ((Instance *)c)->state.time;
    return STATUS_OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, int kind, fmi2Integer *value)
{
    (void)value;
    return instance_fail(c, "status %d is not an integer", kind);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, int kind, fmi2Boolean *value)
{
    if (kind != FMI2_TERMINATED)
        return instance_fail(c, "status %d is not a boolean", kind);
    *value = 0;
    return STATUS_OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, int kind, fmi2String *value)
{
    (void)value;
    return instance_fail(c, "status %d is not a string", kind);
}
