/* FMI 3.0 for co-simulation on top of instance.c. Functions for features that no model here has (other types, clocks,
 * events, derivatives, the other two interface types) report an error that names the feature. */
#include "fmi3.h"

#include <stdlib.h>

static void say(const Instance *self, Status status, const char *message)
{
    ((fmi3LogMessageCallback)self->logger)(self->environment, (fmi3Status)status, "logStatusError", message);
}

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    (void)c, (void)on, (void)n, (void)categories; /* there are no debug messages; errors are always reported */
    return STATUS_OK;
}

/* Refuse an instantiation: report `why` through the host's callback and return no instance. */
static fmi3Instance refuse(fmi3String name, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                           const char *why)
{
    Instance *self = instance_new(name, MODEL_TOKEN, say, (void (*)(void))logger, environment);
    if (self)
        instance_fail(self, "%s", why);
    instance_free(self);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)token, (void)resources, (void)visible, (void)logging_on;
    return refuse(name, environment, logger, "this FMU offers co-simulation only, no model exchange");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                               fmi3ClockUpdateCallback clock_update, fmi3PreemptionCallback lock,
                                               fmi3PreemptionCallback unlock)
{
    (void)token, (void)resources, (void)visible, (void)logging_on, (void)clock_update, (void)lock, (void)unlock;
    return refuse(name, environment, logger, "this FMU offers co-simulation only, no scheduled execution");
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode,
                                         fmi3Boolean early_return_allowed, const fmi3ValueReference intermediate[],
                                         size_t n_intermediate, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update)
{
    (void)resources, (void)visible, (void)logging_on, (void)early_return_allowed, (void)intermediate, (void)update;
    if (event_mode)
        return refuse(name, environment, logger, "this FMU has no event mode");
    if (n_intermediate > 0)
        return refuse(name, environment, logger, "this FMU gives no intermediate values");
    return instance_new(name, token, say, (void (*)(void))logger, environment);
}

void fmi3FreeInstance(fmi3Instance c) { instance_free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start_time, fmi3Boolean stop_time_defined, fmi3Float64 stop_time)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_time_defined, (void)stop_time;
    const Status status = instance_start_time(c, start_time);
    return status == STATUS_OK ? instance_enter_initialization(c) : status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return instance_exit_initialization(c); }

fmi3Status fmi3Terminate(fmi3Instance c) { return instance_terminate(c); }

fmi3Status fmi3Reset(fmi3Instance c) { return instance_reset(c); }

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Float64 values[],
                          size_t n_values)
{
    if (n != n_values)
        return instance_fail(c, "%zu value references but room for %zu values: there are no arrays", n, n_values);
    return instance_get(c, references, n, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Float64 values[],
                          size_t n_values)
{
    if (n != n_values)
        return instance_fail(c, "%zu value references but %zu values: there are no arrays", n, n_values);
    return instance_set(c, references, n, values);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 h, fmi3Boolean no_set_state_prior,
                      fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_successful_time)
{
    (void)no_set_state_prior;
    const Status status = instance_step(c, time, h);
    *event_handling_needed = *terminate = *early_return = false;
    *last_successful_time = ((Instance *)c)->state.time;
    return status;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { return instance_save(c, state); }

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return instance_restore(c, state); }

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return STATUS_OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(State);
    return STATUS_OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return instance_serialize(c, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return instance_deserialize(c, bytes, size, state);
}

/* Functions for features that these models do not have. */

#define NO_VARIABLES_OF(TYPE)                                                                                          \
    fmi3Status fmi3Get##TYPE(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3##TYPE values[],     \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)references, (void)values, (void)n_values;                                                                \
        return n == 0 ? STATUS_OK : instance_fail(c, "this FMU has no variables of type " #TYPE);                      \
    }                                                                                                                  \
    fmi3Status fmi3Set##TYPE(fmi3Instance c, const fmi3ValueReference references[], size_t n,                          \
                             const fmi3##TYPE values[], size_t n_values)                                               \
    {                                                                                                                  \
        (void)references, (void)values, (void)n_values;                                                                \
        return n == 0 ? STATUS_OK : instance_fail(c, "this FMU has no variables of type " #TYPE);                      \
    }

NO_VARIABLES_OF(Float32)
NO_VARIABLES_OF(Int8)
NO_VARIABLES_OF(UInt8)
NO_VARIABLES_OF(Int16)
NO_VARIABLES_OF(UInt16)
NO_VARIABLES_OF(Int32)
NO_VARIABLES_OF(UInt32)
NO_VARIABLES_OF(Int64)
NO_VARIABLES_OF(UInt64)
NO_VARIABLES_OF(Boolean)
NO_VARIABLES_OF(String)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference references[], size_t n, size_t sizes[],
                         fmi3Binary values[], size_t n_values)
{
    (void)references, (void)n, (void)sizes, (void)values, (void)n_values;
    return instance_fail(c, "this FMU has no variables of type Binary");
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference references[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t n_values)
{
    (void)references, (void)n, (void)sizes, (void)values, (void)n_values;
    return instance_fail(c, "this FMU has no variables of type Binary");
}

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Clock values[])
{
    (void)references, (void)n, (void)values;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference references[], size_t n, const fmi3Clock values[])
{
    (void)references, (void)n, (void)values;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                  fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
{
    (void)references, (void)n, (void)intervals, (void)qualifiers;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                   fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)references, (void)n, (void)counters, (void)resolutions, (void)qualifiers;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3Float64 shifts[])
{
    (void)references, (void)n, (void)shifts;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[])
{
    (void)references, (void)n, (void)counters, (void)resolutions;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                  const fmi3Float64 intervals[])
{
    (void)references, (void)n, (void)intervals;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)references, (void)n, (void)counters, (void)resolutions;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                               const fmi3Float64 shifts[])
{
    (void)references, (void)n, (void)shifts;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)references, (void)n, (void)counters, (void)resolutions;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock, (void)time;
    return instance_fail(c, "this FMU has no clocks");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference reference, size_t *n)
{
    (void)reference, (void)n;
    return instance_fail(c, "this FMU does not state dependencies");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t dependent_elements[],
                                       fmi3ValueReference independents[], size_t independent_elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent, (void)dependent_elements, (void)independents, (void)independent_elements, (void)kinds, (void)n;
    return instance_fail(c, "this FMU does not state dependencies");
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    (void)unknowns, (void)n_unknowns, (void)knowns, (void)n_knowns, (void)seed, (void)n_seed, (void)sensitivity, (void)n_sensitivity;
    return instance_fail(c, "this FMU offers no derivatives");
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    (void)unknowns, (void)n_unknowns, (void)knowns, (void)n_knowns, (void)seed, (void)n_seed, (void)sensitivity, (void)n_sensitivity;
    return instance_fail(c, "this FMU offers no derivatives");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values)
{
    (void)references, (void)n, (void)orders, (void)values, (void)n_values;
    return instance_fail(c, "this FMU offers no derivatives");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    return instance_fail(c, "this FMU has no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    return instance_fail(c, "this FMU has no structural parameters");
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    return instance_fail(c, "this FMU has no event mode");
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    return instance_fail(c, "this FMU has no event mode");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    return instance_fail(c, "this FMU has no event mode");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *need_update, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                    fmi3Boolean *next_event_defined, fmi3Float64 *next_event_time)
{
    (void)need_update, (void)terminate, (void)nominals_changed, (void)states_changed, (void)next_event_defined, (void)next_event_time;
    return instance_fail(c, "this FMU has no event mode");
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state_prior, fmi3Boolean *enter_event_mode,
                                       fmi3Boolean *terminate)
{
    (void)no_set_state_prior, (void)enter_event_mode, (void)terminate;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    (void)time;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t n)
{
    (void)states, (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t n)
{
    (void)derivatives, (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n)
{
    (void)indicators, (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 states[], size_t n)
{
    (void)states, (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n)
{
    (void)nominals, (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    (void)n;
    return instance_fail(c, "this FMU offers no model exchange");
}
