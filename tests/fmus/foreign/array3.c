/* A foreign FMI 3.0 FMU, written without fmus/fmi: a[n] integrates the scalar input, n is a structural parameter.
 * Its solver runs at 10 ms; `mood` 1 ends early, 2 asks to end the simulation, 3 stops at its last whole solver step. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
typedef uint32_t VR;
typedef void (*Logger)(void *, int, const char *, const char *);

typedef struct { Logger logger; void *env; double u, a[8]; float f; int32_t mood; uint64_t n; bool configuring; } Array;

API const char *fmi3GetVersion(void) { return "3.0"; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool visible, bool logging,
                                      bool event_mode, bool early, const VR need[], size_t n_need, void *env,
                                      Logger logger, void *update)
{
    (void)visible, (void)logging, (void)need, (void)update, (void)where;
    if (!*name || strcmp(token, "array") || event_mode || early || n_need)
        return NULL;
    Array *c = calloc(1, sizeof *c);
    c->logger = logger;
    c->env = env;
    c->n = 3;
    return c;
}
API void fmi3FreeInstance(void *c) { free(c); }
API int fmi3EnterConfigurationMode(void *c) { ((Array *)c)->configuring = true; return 0; }
API int fmi3ExitConfigurationMode(void *c) { ((Array *)c)->configuring = false; return 0; }
API int fmi3EnterInitializationMode(void *c, bool a, double b, double t0, bool d, double e)
{
    (void)a, (void)b, (void)d, (void)e;
    return ((Array *)c)->configuring || t0 != 0 ? 3 : 0;
}
API int fmi3ExitInitializationMode(void *c) { (void)c; return 0; }
API int fmi3Terminate(void *c) { (void)c; return 0; }
API int fmi3GetFloat64(void *v, const VR r[], size_t n, double out[], size_t n_out)
{
    Array *c = v;
    if (n == 1 && r[0] == 2) {
        if (n_out != 3)
            return 3;
        memcpy(out, c->a, n_out * sizeof *out);
        return 0;
    }
    for (size_t i = 0; i < n; i++)
        out[i] = r[i] == 1 ? c->u : c->a[0];
    return 0;
}
API int fmi3SetFloat64(void *v, const VR r[], size_t n, const double in[], size_t n_in)
{
    Array *c = v;
    if (n == 1 && r[0] == 2) {
        if (n_in != 3)
            return 3;
        memcpy(c->a, in, n_in * sizeof *in);
        return 0;
    }
    c->u = in[0];
    return 0;
}
API int fmi3GetFloat32(void *v, const VR r[], size_t n, float out[], size_t m) { (void)r, (void)n, (void)m; out[0] = ((Array *)v)->f; return 0; }
API int fmi3SetFloat32(void *v, const VR r[], size_t n, const float in[], size_t m) { (void)r, (void)n, (void)m; ((Array *)v)->f = in[0]; return 0; }
API int fmi3GetInt32(void *v, const VR r[], size_t n, int32_t out[], size_t m) { (void)r, (void)n, (void)m; out[0] = ((Array *)v)->mood; return 0; }
API int fmi3SetInt32(void *v, const VR r[], size_t n, const int32_t in[], size_t m) { (void)r, (void)n, (void)m; ((Array *)v)->mood = in[0]; return 0; }
API int fmi3GetUInt64(void *v, const VR r[], size_t n, uint64_t out[], size_t m) { (void)r, (void)n, (void)m; out[0] = ((Array *)v)->n; return 0; }
API int fmi3SetUInt64(void *v, const VR r[], size_t n, const uint64_t in[], size_t m)
{
    (void)r, (void)n, (void)m;
    if (!((Array *)v)->configuring)
        return 3;
    ((Array *)v)->n = in[0];
    return 0;
}
API int fmi3DoStep(void *v, double t, double h, bool prior, bool *event, bool *end, bool *early, double *last)
{
    Array *c = v;
    (void)prior;
    for (int i = 0; i < 3; i++)
        c->a[i] += h * c->u * (i + 1);
    *event = false;
    *early = c->mood == 1;
    *end = c->mood == 2;
    *last = c->mood == 3 ? floor((t + h) / 0.01 + 1e-6) * 0.01 : t + h;
    if (c->mood == 1 || c->mood == 2)
        c->logger(c->env, 1, "all", "mood is 100%");
    return 0;
}
