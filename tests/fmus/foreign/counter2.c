/* A foreign FMI 2.0 FMU, written without fmus/fmi: x counts steps, s(t + h) = s(t) + h gain u.
 * `mood` makes it misbehave: 1 error, 2 discard, 3 fatal, 4 warning, 5 not-a-number output. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
typedef unsigned int VR;
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger logger; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished, *env; } Host;

typedef struct { Host host; double u, s, gain; int steps, mood, ready, dead; char label[64]; } Counter;

API const char *fmi2GetVersion(void) { return "2.0"; }
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API void *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const Host *host, int v, int l)
{
    (void)name, (void)v, (void)l;
    if (type != 1 || strcmp(guid, "counter") || strncmp(where, "file:///", 8)) {
        host->logger(host->env, name, 3, "all", "guid is %s at %d%%", guid, 100);
        return NULL;
    }
    Counter *c = host->allocate(1, sizeof *c);
    c->host = *host;
    c->gain = 1;
    strcpy(c->label, "none");
    return c;
}
API void fmi2FreeInstance(void *c)
{
    if (((Counter *)c)->dead)
        abort(); /* the standard forbids every call after a fatal status */
    ((Counter *)c)->host.release(c);
}
API int fmi2SetupExperiment(void *c, int a, double b, double t0, int d, double e)
{
    (void)c, (void)a, (void)b, (void)d, (void)e;
    return t0 == 0 ? 0 : 3;
}
API int fmi2EnterInitializationMode(void *c) { return ((Counter *)c)->ready ? 3 : 0; }
API int fmi2ExitInitializationMode(void *c) { ((Counter *)c)->ready = 1; return 0; }
API int fmi2Terminate(void *c) { return ((Counter *)c)->ready ? 0 : 3; }
API int fmi2GetReal(void *v, const VR r[], size_t n, double out[])
{
    Counter *c = v;
    for (size_t i = 0; i < n; i++)
        out[i] = r[i] == 10 ? c->u : r[i] == 11 ? (c->mood == 5 ? NAN : c->s) : c->gain;
    return 0;
}
API int fmi2SetReal(void *v, const VR r[], size_t n, const double in[])
{
    Counter *c = v;
    for (size_t i = 0; i < n; i++)
        *(r[i] == 10 ? &c->u : r[i] == 11 ? &c->s : &c->gain) = in[i];
    return 0;
}
API int fmi2GetInteger(void *v, const VR r[], size_t n, int out[])
{
    Counter *c = v;
    for (size_t i = 0; i < n; i++)
        out[i] = r[i] == 20 ? c->steps : c->mood;
    return 0;
}
API int fmi2SetInteger(void *v, const VR r[], size_t n, const int in[])
{
    Counter *c = v;
    for (size_t i = 0; i < n; i++)
        *(r[i] == 20 ? &c->steps : &c->mood) = in[i];
    return 0;
}
API int fmi2GetBoolean(void *v, const VR r[], size_t n, int out[])
{
    for (size_t i = 0; i < n; i++)
        out[i] = ((Counter *)v)->steps % 2;
    (void)r;
    return 0;
}
API int fmi2GetString(void *v, const VR r[], size_t n, const char *out[])
{
    for (size_t i = 0; i < n; i++)
        out[i] = ((Counter *)v)->label;
    (void)r;
    return 0;
}
API int fmi2SetString(void *v, const VR r[], size_t n, const char *const in[])
{
    (void)r;
    for (size_t i = 0; i < n; i++)
        strncpy(((Counter *)v)->label, in[i], 63);
    return 0;
}
API int fmi2DoStep(void *v, double t, double h, int p)
{
    static const int ANSWER[] = {0, 3, 2, 4, 1, 0};
    Counter *c = v;
    (void)p;
    c->s += h * c->gain * c->u;
    c->steps++;
    c->dead = c->mood == 3;
    if (ANSWER[c->mood])
        c->host.logger(c->host.env, "", ANSWER[c->mood], "all", "mood %d at t=%g, %s", c->mood, t, c->label);
    return ANSWER[c->mood];
}
