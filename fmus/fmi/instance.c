/* The state machine that FMI 2.0 and 3.0 co-simulation share; see instance.h. */
#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double START[VALUES_COUNT] = VALUES_START;
static const char *const NAME[VALUES_COUNT] = VALUES_NAME;
static const char KIND[] = VALUES_KIND; /* per value: i input, p parameter, t tunable parameter, o output with start value, c computed output */
static const char *const MODE[] = {"instantiated", "in initialization mode", "in step mode", "terminated", "in error"};

static const unsigned TIME_REFERENCE = VALUES_COUNT; /* the independent variable of FMI 3.0 */

static void start_over(Instance *self)
{
    memset(&self->state, 0, sizeof self->state);
    memcpy(self->state.values.numbered, START, sizeof START);
}

Status instance_fail(const Instance *self, const char *format, ...)
{
    char message[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    if (self->logger)
        self->say(self, STATUS_ERROR, message);
    return STATUS_ERROR;
}

static Status break_down(Instance *self, const char *name, double value, const char *when)
{
    self->state.mode = BROKEN;
    return instance_fail(self, "%s = %g %s t = %.9g s: a value must be finite; check parameters, inputs and step size",
                         name, value, when, self->state.time);
}

static Status wrong_mode(const Instance *self, const char *what)
{
    return instance_fail(self, "cannot %s: the instance is %s", what, MODE[self->state.mode]);
}

Instance *instance_new(const char *name, const char *token, Say say, void (*logger)(void), void *environment)
{
    Instance *self = calloc(1, sizeof *self);
    if (!self)
        return NULL;
    self->say = say;
    self->logger = logger;
    self->environment = environment;
    for (unsigned i = 0; i < VALUES_COUNT; i++)
        if (KIND[i] == 'o' || KIND[i] == 'c')
            self->outputs[self->outputs_count++] = i;
    self->name = calloc(1, name ? strlen(name) + 1 : 1);
    if (self->name && name)
        strcpy(self->name, name);
    if (!self->name || !name || !*name) {
        instance_fail(self, "an instance needs a name");
    } else if (!token || strcmp(token, MODEL_TOKEN) != 0) {
        instance_fail(self, "token %s of the model description is not %s of the binary: the archive mixes two builds",
                      token ? token : "(none)", MODEL_TOKEN);
    } else {
        start_over(self);
        return self;
    }
    instance_free(self);
    return NULL;
}

void instance_free(Instance *self)
{
    if (self)
        free(self->name);
    free(self);
}

Status instance_start_time(Instance *self, double time)
{
    if (self->state.mode != INSTANTIATED)
        return wrong_mode(self, "set the start time");
    if (!isfinite(time))
        return instance_fail(self, "start time %g s: a time must be finite", time);
    self->state.time = time;
    return STATUS_OK;
}

Status instance_enter_initialization(Instance *self)
{
    if (self->state.mode != INSTANTIATED)
        return wrong_mode(self, "enter initialization mode");
    self->state.mode = INITIALIZING;
    self->state.outputs_stale = true;
    return STATUS_OK;
}

/* Bring the outputs up to date; while initializing, the states too. */
static Status refresh(Instance *self)
{
    State *state = &self->state;
#ifdef MODEL_HAS_START
    if (state->mode == INITIALIZING)
        model_start(&state->values.named);
#endif
#ifdef MODEL_HAS_OUTPUTS
    model_outputs(&state->values.named);
#endif
    state->outputs_stale = false;
    for (unsigned k = 0; k < self->outputs_count; k++) {
        const unsigned i = self->outputs[k];
        if (!isfinite(state->values.numbered[i]))
            return break_down(self, NAME[i], state->values.numbered[i], "at");
    }
    return STATUS_OK;
}

Status instance_exit_initialization(Instance *self)
{
    if (self->state.mode != INITIALIZING)
        return wrong_mode(self, "exit initialization mode");
    if (refresh(self) != STATUS_OK)
        return STATUS_ERROR;
    self->state.mode = STEPPING;
    return STATUS_OK;
}

Status instance_terminate(Instance *self)
{
    if (self->state.mode != STEPPING)
        return wrong_mode(self, "terminate");
    self->state.mode = TERMINATED;
    return STATUS_OK;
}

Status instance_reset(Instance *self)
{
    start_over(self);
    return STATUS_OK;
}

static bool settable(const State *state, unsigned reference)
{
    if (KIND[reference] == 'i' || KIND[reference] == 't')
        return state->mode <= STEPPING;
    return KIND[reference] != 'c' && state->mode <= INITIALIZING;
}

/* Sets all of the values or, on error, none. */
Status instance_set(Instance *self, const unsigned references[], size_t n, const double values[])
{
    State *state = &self->state;
    for (size_t k = 0; k < n; k++) {
        const unsigned i = references[k];
        if (i >= VALUES_COUNT)
            return instance_fail(self, "cannot set value reference %u: the references end at %d", i, VALUES_COUNT - 1);
        if (!settable(state, i))
            return instance_fail(self, "cannot set %s: it is %s and the instance is %s", NAME[i],
                                 KIND[i] == 'p' || KIND[i] == 't' ? "a parameter" : KIND[i] == 'i' ? "an input" : "an output",
                                 MODE[state->mode]);
        if (!isfinite(values[k]))
            return instance_fail(self, "%s = %g set at t = %.9g s: a value must be finite", NAME[i], values[k],
                                 state->time);
    }
    for (size_t k = 0; k < n; k++)
        state->values.numbered[references[k]] = values[k];
    state->outputs_stale = true;
    return STATUS_OK;
}

Status instance_get(Instance *self, const unsigned references[], size_t n, double values[])
{
    State *state = &self->state;
    const bool computes = state->mode == INITIALIZING || state->mode == STEPPING;
    if (state->outputs_stale && computes && refresh(self) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        if (references[k] > TIME_REFERENCE)
            return instance_fail(self, "cannot get value reference %u: the references end at %d", references[k],
                                 VALUES_COUNT - 1);
        values[k] = references[k] == TIME_REFERENCE ? state->time : state->values.numbered[references[k]];
    }
    return STATUS_OK;
}

Status instance_step(Instance *self, double time, double h)
{
    State *state = &self->state;
    if (state->mode != STEPPING)
        return wrong_mode(self, "step");
    if (!(isfinite(h) && h > 0))
        return instance_fail(self, "step of %g s at t = %.9g s: expected a finite step > 0", h, state->time);
    if (!(fabs(time - state->time) <= 1e-9 * (1 + fabs(state->time))))
        return instance_fail(self, "step from t = %.9g s, but the last step ended at %.9g s", time, state->time);
    model_step(&state->values.named, h);
    state->time = time + h;
    return refresh(self);
}

Status instance_save(const Instance *self, void **state)
{
    if (!*state)
        *state = malloc(sizeof self->state);
    if (!*state)
        return instance_fail(self, "no memory for a saved state");
    memcpy(*state, &self->state, sizeof self->state);
    return STATUS_OK;
}

Status instance_restore(Instance *self, const void *state)
{
    if (!state)
        return instance_fail(self, "there is no saved state to restore");
    memcpy(&self->state, state, sizeof self->state);
    return STATUS_OK;
}

Status instance_serialize(const Instance *self, const void *state, void *bytes, size_t size)
{
    if (!state || size != sizeof self->state)
        return instance_fail(self, "a saved state holds %zu bytes, the buffer %zu", sizeof self->state, size);
    memcpy(bytes, state, size);
    return STATUS_OK;
}

Status instance_deserialize(const Instance *self, const void *bytes, size_t size, void **state)
{
    if (size != sizeof self->state)
        return instance_fail(self, "a saved state holds %zu bytes, not %zu", sizeof self->state, size);
    if (!*state)
        *state = malloc(size);
    if (!*state)
        return instance_fail(self, "no memory for a saved state");
    memcpy(*state, bytes, size);
    return STATUS_OK;
}
