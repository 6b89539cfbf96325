/* One co-simulation instance of a model, the same for every version of FMI.
 *
 *   INSTANTIATED --enter--> INITIALIZING --exit--> STEPPING --terminate--> TERMINATED
 *
 * An error while stepping leads to BROKEN; only a reset, a restored state or `instance_free` leaves that mode.
 * fmi2.c and fmi3.c translate the two standards to the functions below; neither knows the model.
 *
 * model.c defines `model_step` and, if `functions` of variables.toml lists them, `model_start` and `model_outputs`.
 * Values are doubles in the order of variables.toml; the position of a value is its value reference. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "variables.h"

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

void model_step(Values *v, double h /* [s], > 0; inputs are constant over it */);
#ifdef MODEL_HAS_START
void model_start(Values *v); /* called when all start values are set: initialize the states */
#endif
#ifdef MODEL_HAS_OUTPUTS
void model_outputs(Values *v); /* called after inputs or states have changed: compute the outputs */
#endif

typedef enum { STATUS_OK = 0, STATUS_ERROR = 3 } Status; /* the numbers are those of FMI 2.0 and 3.0 */

typedef enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED, BROKEN } Mode;

typedef union {
    Values named;
    double numbered[VALUES_COUNT];
} AllValues;

typedef struct {
    AllValues values;
    double time;        /* [s] */
    bool outputs_stale; /* an input or a state has changed since the outputs were computed */
    Mode mode;
} State;

typedef struct Instance {
    State state;
    void (*say)(const struct Instance *self, Status status, const char *message);
    void (*logger)(void); /* the host's callback, called by `say` in its own type */
    void *environment;    /* the host's pointer, passed to its callback */
    char *name;
    unsigned outputs[VALUES_COUNT]; /* value references that a step computes */
    unsigned outputs_count;
} Instance;

typedef void (*Say)(const Instance *self, Status status, const char *message);

Instance *instance_new(const char *name, const char *token, Say say, void (*logger)(void), void *environment);
void instance_free(Instance *self);
Status instance_fail(const Instance *self, const char *format, ...);

Status instance_start_time(Instance *self, double time);
Status instance_enter_initialization(Instance *self);
Status instance_exit_initialization(Instance *self);
Status instance_terminate(Instance *self);
Status instance_reset(Instance *self);

Status instance_set(Instance *self, const unsigned references[], size_t n, const double values[]);
Status instance_get(Instance *self, const unsigned references[], size_t n, double values[]);
Status instance_step(Instance *self, double time, double h);

Status instance_save(const Instance *self, void **state);
Status instance_restore(Instance *self, const void *state);
Status instance_serialize(const Instance *self, const void *state, void *bytes, size_t size);
Status instance_deserialize(const Instance *self, const void *bytes, size_t size, void **state);

#endif
