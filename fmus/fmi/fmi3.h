/* Types and prototypes of FMI 3.0, written from the standard (FMI 3.0.2, chapter 2). The functions of model exchange and
 * scheduled execution exist because the standard requires every function to be exported; they report an error. */
#ifndef FMI3_H
#define FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "instance.h"

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef int fmi3Status;            /* OK 0, warning 1, discard 2, error 3, fatal 4 */
typedef int fmi3DependencyKind;    /* independent 0 .. dependent 5 */
typedef int fmi3IntervalQualifier; /* not yet known 0, unchanged 1, changed 2 */

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 time, fmi3Boolean set_requested,
                                               fmi3Boolean get_allowed, fmi3Boolean step_finished,
                                               fmi3Boolean can_return_early, fmi3Boolean *early_return,
                                               fmi3Float64 *early_return_time);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3PreemptionCallback)(void);

EXPORT const char *fmi3GetVersion(void);
EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance, fmi3Boolean on, size_t n, const fmi3String categories[]);

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean logging_on,
                                                 fmi3InstanceEnvironment, fmi3LogMessageCallback);
EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                fmi3Boolean visible, fmi3Boolean logging_on, fmi3Boolean event_mode,
                                                fmi3Boolean early_return_allowed,
                                                const fmi3ValueReference intermediate[], size_t n_intermediate,
                                                fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                                fmi3IntermediateUpdateCallback);
EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                      fmi3Boolean visible, fmi3Boolean logging_on,
                                                      fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                                      fmi3ClockUpdateCallback, fmi3PreemptionCallback lock,
                                                      fmi3PreemptionCallback unlock);
EXPORT void fmi3FreeInstance(fmi3Instance);

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_time_defined,
                                              fmi3Float64 stop_time);
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance);
EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance);
EXPORT fmi3Status fmi3Terminate(fmi3Instance);
EXPORT fmi3Status fmi3Reset(fmi3Instance);

#define FMI3_GET_AND_SET(TYPE)                                                                                         \
    EXPORT fmi3Status fmi3Get##TYPE(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3##TYPE values[],           \
                                    size_t n_values);                                                                  \
    EXPORT fmi3Status fmi3Set##TYPE(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3##TYPE values[],     \
                                    size_t n_values);
FMI3_GET_AND_SET(Float32)
FMI3_GET_AND_SET(Float64)
FMI3_GET_AND_SET(Int8)
FMI3_GET_AND_SET(UInt8)
FMI3_GET_AND_SET(Int16)
FMI3_GET_AND_SET(UInt16)
FMI3_GET_AND_SET(Int32)
FMI3_GET_AND_SET(UInt32)
FMI3_GET_AND_SET(Int64)
FMI3_GET_AND_SET(UInt64)
FMI3_GET_AND_SET(Boolean)
FMI3_GET_AND_SET(String)
#undef FMI3_GET_AND_SET

EXPORT fmi3Status fmi3GetBinary(fmi3Instance, const fmi3ValueReference[], size_t n, size_t sizes[], fmi3Binary values[],
                                size_t n_values);
EXPORT fmi3Status fmi3SetBinary(fmi3Instance, const fmi3ValueReference[], size_t n, const size_t sizes[],
                                const fmi3Binary values[], size_t n_values);
EXPORT fmi3Status fmi3GetClock(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Clock values[]);
EXPORT fmi3Status fmi3SetClock(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Clock values[]);

EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance, fmi3ValueReference, size_t *n);
EXPORT fmi3Status fmi3GetVariableDependencies(fmi3Instance, fmi3ValueReference dependent, size_t dependent_elements[],
                                              fmi3ValueReference independents[], size_t independent_elements[],
                                              fmi3DependencyKind kinds[], size_t n);

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance, fmi3FMUState *);
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance, fmi3FMUState);
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState *);
EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance, fmi3FMUState, size_t *size);
EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance, fmi3FMUState, fmi3Byte bytes[], size_t size);
EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *);

EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                               const fmi3ValueReference knowns[], size_t n_knowns,
                                               const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                               size_t n_sensitivity);
EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                           const fmi3ValueReference knowns[], size_t n_knowns,
                                           const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                           size_t n_sensitivity);
EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance, const fmi3ValueReference[], size_t n,
                                           const fmi3Int32 orders[], fmi3Float64 values[], size_t n_values);

EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance);
EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance);

EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Float64 intervals[],
                                         fmi3IntervalQualifier qualifiers[]);
EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3UInt64 counters[],
                                          fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]);
EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3Float64 shifts[]);
EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t n, fmi3UInt64 counters[],
                                       fmi3UInt64 resolutions[]);
EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance, const fmi3ValueReference[], size_t n,
                                         const fmi3Float64 intervals[]);
EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance, const fmi3ValueReference[], size_t n,
                                          const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3Float64 shifts[]);
EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance, const fmi3ValueReference[], size_t n, const fmi3UInt64 counters[],
                                       const fmi3UInt64 resolutions[]);

EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance);
EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, fmi3Boolean *need_update, fmi3Boolean *terminate,
                                           fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                           fmi3Boolean *next_event_defined, fmi3Float64 *next_event_time);

EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance);
EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance, fmi3Boolean no_set_state_prior,
                                              fmi3Boolean *enter_event_mode, fmi3Boolean *terminate);
EXPORT fmi3Status fmi3SetTime(fmi3Instance, fmi3Float64 time);
EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance, const fmi3Float64 states[], size_t n);
EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance, fmi3Float64 derivatives[], size_t n);
EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance, fmi3Float64 indicators[], size_t n);
EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance, fmi3Float64 states[], size_t n);
EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance, fmi3Float64 nominals[], size_t n);
EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance, size_t *n);
EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance, size_t *n);

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance);
EXPORT fmi3Status fmi3DoStep(fmi3Instance, fmi3Float64 time, fmi3Float64 h, fmi3Boolean no_set_state_prior,
                             fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                             fmi3Float64 *last_successful_time);
EXPORT fmi3Status fmi3ActivateModelPartition(fmi3Instance, fmi3ValueReference clock, fmi3Float64 time);

#endif
