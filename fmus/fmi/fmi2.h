/* Types and prototypes of FMI 2.0 as far as co-simulation needs them, written from the standard (FMI 2.0.4, chapters 2
 * and 4). */
#ifndef FMI2_H
#define FMI2_H

#include <stddef.h>

#include "instance.h"

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef int fmi2Status; /* OK 0, warning 1, discard 2, error 3, fatal 4, pending 5 */

enum { FMI2_CO_SIMULATION = 1 };     /* fmi2Type */
enum { FMI2_LAST_SUCCESSFUL_TIME = 2, FMI2_TERMINATED = 3 }; /* fmi2StatusKind */

typedef void (*fmi2Logger)(fmi2ComponentEnvironment, fmi2String instance, fmi2Status, fmi2String category,
                           fmi2String format, ...);

typedef struct {
    fmi2Logger logger;
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment environment;
} fmi2CallbackFunctions;

EXPORT const char *fmi2GetTypesPlatform(void);
EXPORT const char *fmi2GetVersion(void);
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component, fmi2Boolean on, size_t n, const fmi2String categories[]);

EXPORT fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *, fmi2Boolean visible, fmi2Boolean logging_on);
EXPORT void fmi2FreeInstance(fmi2Component);
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                                      fmi2Real start_time, fmi2Boolean stop_time_defined, fmi2Real stop_time);
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component);
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component);
EXPORT fmi2Status fmi2Terminate(fmi2Component);
EXPORT fmi2Status fmi2Reset(fmi2Component);

EXPORT fmi2Status fmi2GetReal(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Real values[]);
EXPORT fmi2Status fmi2GetInteger(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Integer values[]);
EXPORT fmi2Status fmi2GetBoolean(fmi2Component, const fmi2ValueReference[], size_t n, fmi2Boolean values[]);
EXPORT fmi2Status fmi2GetString(fmi2Component, const fmi2ValueReference[], size_t n, fmi2String values[]);
EXPORT fmi2Status fmi2SetReal(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Real values[]);
EXPORT fmi2Status fmi2SetInteger(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Integer values[]);
EXPORT fmi2Status fmi2SetBoolean(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2Boolean values[]);
EXPORT fmi2Status fmi2SetString(fmi2Component, const fmi2ValueReference[], size_t n, const fmi2String values[]);

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate *);
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate *);
EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t *size);
EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, fmi2Byte bytes[], size_t size);
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *);

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                               const fmi2ValueReference knowns[], size_t n_knowns,
                                               const fmi2Real seed[], fmi2Real sensitivity[]);
EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component, const fmi2ValueReference[], size_t n,
                                              const fmi2Integer orders[], const fmi2Real values[]);
EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component, const fmi2ValueReference[], size_t n,
                                               const fmi2Integer orders[], fmi2Real values[]);

EXPORT fmi2Status fmi2DoStep(fmi2Component, fmi2Real time, fmi2Real h, fmi2Boolean no_set_state_prior);
EXPORT fmi2Status fmi2CancelStep(fmi2Component);
EXPORT fmi2Status fmi2GetStatus(fmi2Component, int kind, fmi2Status *);
EXPORT fmi2Status fmi2GetRealStatus(fmi2Component, int kind, fmi2Real *);
EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component, int kind, fmi2Integer *);
EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component, int kind, fmi2Boolean *);
EXPORT fmi2Status fmi2GetStringStatus(fmi2Component, int kind, fmi2String *);

#endif
