/* A foreign FMI 2.0 FMU with a variable of every type, written without fmus/fmi. It keeps what it is given.
 * Reference 0 of each type; Integer 1 is the enumeration. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
typedef unsigned int VR;
typedef struct { void *logger; void *(*allocate)(size_t, size_t); void (*release)(void *); void *finished, *env; } Host;
typedef struct { Host host; double real; int integer[2], boolean; char text[256]; } Types;

API const char *fmi2GetVersion(void) { return "2.0"; }
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API void *fmi2Instantiate(const char *name, int type, const char *guid, const char *where, const Host *host, int v, int l)
{
    (void)name, (void)v, (void)l, (void)where, (void)guid, (void)type;
    Types *c = host->allocate(1, sizeof *c);
    c->host = *host;
    return c;
}
API void fmi2FreeInstance(void *c) { ((Types *)c)->host.release(c); }
API int fmi2SetupExperiment(void *c, int a, double b, double t0, int d, double e)
{
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)t0;
    return 0;
}
API int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
API int fmi2ExitInitializationMode(void *c) { (void)c; return 0; }
API int fmi2Terminate(void *c) { (void)c; return 0; }
API int fmi2DoStep(void *c, double t, double h, int p) { (void)c, (void)t, (void)h, (void)p; return 0; }
API int fmi2GetReal(void *v, const VR r[], size_t n, double out[]) { (void)r, (void)n; out[0] = ((Types *)v)->real; return 0; }
API int fmi2SetReal(void *v, const VR r[], size_t n, const double in[]) { (void)r, (void)n; ((Types *)v)->real = in[0]; return 0; }
API int fmi2GetInteger(void *v, const VR r[], size_t n, int out[]) { (void)n; out[0] = ((Types *)v)->integer[r[0]]; return 0; }
API int fmi2SetInteger(void *v, const VR r[], size_t n, const int in[]) { (void)n; ((Types *)v)->integer[r[0]] = in[0]; return 0; }
API int fmi2GetBoolean(void *v, const VR r[], size_t n, int out[]) { (void)r, (void)n; out[0] = ((Types *)v)->boolean; return 0; }
API int fmi2SetBoolean(void *v, const VR r[], size_t n, const int in[]) { (void)r, (void)n; ((Types *)v)->boolean = in[0]; return 0; }
API int fmi2GetString(void *v, const VR r[], size_t n, const char *out[]) { (void)r, (void)n; out[0] = ((Types *)v)->text; return 0; }
API int fmi2SetString(void *v, const VR r[], size_t n, const char *const in[])
{
    (void)r, (void)n;
    strncpy(((Types *)v)->text, in[0], 255);
    return 0;
}
