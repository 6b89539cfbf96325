/* A foreign FMI 3.0 FMU, written without fmus/fmi: a stair that rises by 1 every 0.1 s and ends the simulation at 5.
 * Its solver steps by 0.02 s; it refuses communication points that are no multiples of that. It has an event mode, and
 * handles its events itself where it is told that the host uses none. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
#define SOLVER 0.02
#define RISE 0.1
typedef uint32_t VR;
typedef struct { double time; int64_t steps; int32_t stair; double level; } Stair;

API const char *fmi3GetVersion(void) { return "3.0"; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool visible, bool logging,
                                      bool event_mode, bool early, const VR need[], size_t n_need, void *env,
                                      void *logger, void *update)
{
    (void)name, (void)where, (void)visible, (void)logging, (void)need, (void)env, (void)logger, (void)update;
    return strcmp(token, "stair") || event_mode || early || n_need ? NULL : calloc(1, sizeof(Stair));
}
API void fmi3FreeInstance(void *c) { free(c); }
API int fmi3EnterInitializationMode(void *c, bool a, double b, double t0, bool d, double e)
{
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)t0;
    return 0;
}
API int fmi3ExitInitializationMode(void *c) { (void)c; return 0; }
API int fmi3Terminate(void *c) { (void)c; return 0; }
API int fmi3GetInt32(void *v, const VR r[], size_t n, int32_t out[], size_t m)
{
    (void)r, (void)n, (void)m;
    out[0] = ((Stair *)v)->stair;
    return 0;
}
API int fmi3GetFloat64(void *v, const VR r[], size_t n, double out[], size_t m)
{
    (void)r, (void)m;
    for (size_t k = 0; k < n; k++)
        out[k] = ((Stair *)v)->level;
    return 0;
}
API int fmi3DoStep(void *v, double t, double h, bool prior, bool *event, bool *end, bool *early, double *last)
{
    Stair *c = v;
    (void)prior;
    *event = *end = *early = false;
    if (fabs(t - c->steps * SOLVER) > 1e-9 || fabs(h / SOLVER - round(h / SOLVER)) > 1e-6)
        return 3;
    for (int k = (int)round(h / SOLVER); k > 0 && !*end; k--) {
        c->steps++;
        c->stair = (int32_t)floor(c->steps * SOLVER / RISE + 1e-6);
        c->level = c->stair;
        *end = c->stair >= 5;
    }
    *last = c->steps * SOLVER;
    return 0;
}
