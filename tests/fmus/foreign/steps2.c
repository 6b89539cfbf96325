/* A foreign FMI 2.0 FMU, written without fmus/fmi: x(t + STEP) = x(t) + STEP u, y = x.
 * STEP > 0: it takes only steps of this size from multiples of it, and refuses any other with an error.
 * STOP > 0: it ends the simulation in the step that would pass this instant, by discard and fmi2Terminated. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
typedef unsigned int VR;
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct { Logger logger; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished, *env; } Host;
typedef struct { Host host; double u, x, time; int ended; } Steps;

API const char *fmi2GetVersion(void) { return "2.0"; }
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API void *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const Host *host, int v, int l)
{
    (void)name, (void)v, (void)l, (void)where, (void)guid, (void)type;
    Steps *c = host->allocate(1, sizeof *c);
    c->host = *host;
    return c;
}
API void fmi2FreeInstance(void *c) { ((Steps *)c)->host.release(c); }
API int fmi2SetupExperiment(void *c, int a, double b, double t0, int d, double e)
{
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)t0;
    return 0;
}
API int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
API int fmi2ExitInitializationMode(void *c) { (void)c; return 0; }
API int fmi2Terminate(void *c) { (void)c; return 0; }
API int fmi2GetReal(void *v, const VR r[], size_t n, double out[])
{
    for (size_t i = 0; i < n; i++)
        out[i] = r[i] == 0 ? ((Steps *)v)->u : r[i] == 1 ? ((Steps *)v)->x : 0;
    return 0;
}
API int fmi2SetReal(void *v, const VR r[], size_t n, const double in[])
{
    (void)r;
    ((Steps *)v)->u = in[n - 1];
    return 0;
}
API int fmi2DoStep(void *v, double t, double h, int p)
{
    Steps *c = v;
    (void)p;
    if (STEP > 0 && (fabs(h - STEP) > 1e-12 || fabs(t - STEP * round(t / STEP)) > 1e-9)) {
        c->host.logger(c->host.env, "", 3, "all", "a step of %g s from %g s", h, t);
        return 3;
    }
    if (fabs(t - c->time) > 1e-9)
        return 3;
    if (STOP > 0 && t + h > STOP + 1e-9) {
        c->ended = 1;
        c->time = STOP;
        return 2;
    }
    c->x += h * c->u;
    c->time = t + h;
    return 0;
}
API int fmi2GetBooleanStatus(void *v, int kind, int *value)
{
    *value = ((Steps *)v)->ended;
    return kind == 3 ? 0 : 2;
}
API int fmi2GetRealStatus(void *v, int kind, double *value)
{
    *value = ((Steps *)v)->time;
    return kind == 2 ? 0 : 2;
}
