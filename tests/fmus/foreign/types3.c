/* A foreign FMI 3.0 FMU with a variable of every type, written without fmus/fmi. It keeps what it is given.
 *
 * reference   0 Float32   1 Float64   2 Int8   3 UInt8   4 Int16   5 UInt16   6 Int32   7 UInt32   8 Int64   9 UInt64
 *            10 Boolean  11 String   12 Binary  13 Enumeration (Int64)
 *            20 rows, 21 columns: structural parameters   22 Float64 matrix rows x columns   23 Int16 vector of columns
 *            24 String vector of columns   25 output: sum of the matrix */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define API __attribute__((visibility("default")))
#define MOST 64
typedef uint32_t VR;
typedef const char *String;
typedef struct { size_t size; uint8_t bytes[256]; } Blob;

typedef struct {
    bool configuring, running;
    uint64_t rows, columns;
    double matrix[MOST], Float64;
    float Float32;
    int8_t Int8; uint8_t UInt8; int16_t Int16, vector[MOST]; uint16_t UInt16; int32_t Int32; uint32_t UInt32;
    int64_t Int64, item; uint64_t UInt64;
    bool Boolean;
    char text[256], texts[8][256];
    Blob blob;
} Types;

API const char *fmi3GetVersion(void) { return "3.0"; }
API void *fmi3InstantiateCoSimulation(String name, String token, String where, bool visible, bool logging,
                                      bool event_mode, bool early, const VR need[], size_t n_need, void *env,
                                      void *logger, void *update)
{
    (void)name, (void)where, (void)visible, (void)logging, (void)need, (void)env, (void)logger, (void)update;
    if (strcmp(token, "types") || event_mode || early || n_need)
        return NULL;
    Types *c = calloc(1, sizeof *c);
    c->rows = 2;
    c->columns = 3;
    return c;
}
API void fmi3FreeInstance(void *c) { free(c); }
API int fmi3EnterConfigurationMode(void *c) { ((Types *)c)->configuring = true; return 0; }
API int fmi3ExitConfigurationMode(void *c) { ((Types *)c)->configuring = false; return 0; }
API int fmi3EnterInitializationMode(void *v, bool a, double b, double t0, bool d, double e)
{
    (void)a, (void)b, (void)d, (void)e, (void)t0;
    return ((Types *)v)->configuring ? 3 : 0;
}
API int fmi3ExitInitializationMode(void *v) { ((Types *)v)->running = true; return 0; }
API int fmi3Terminate(void *c) { (void)c; return 0; }
API int fmi3DoStep(void *v, double t, double h, bool prior, bool *event, bool *end, bool *early, double *last)
{
    (void)v, (void)prior;
    *event = *end = *early = false;
    *last = t + h;
    return 0;
}

#define ACCESS(NAME, TYPE)                                                                                             \
    API int fmi3Get##NAME(void *v, const VR r[], size_t n, TYPE out[], size_t n_out)                                   \
    {                                                                                                                  \
        size_t count, done = 0;                                                                                        \
        for (size_t k = 0; k < n; k++) {                                                                               \
            TYPE *from = place_##NAME(v, r[k], &count);                                                                \
            if (!from || done + count > n_out)                                                                         \
                return 3;                                                                                              \
            memcpy(out + done, from, count * sizeof *out);                                                             \
            done += count;                                                                                             \
        }                                                                                                              \
        return done == n_out ? 0 : 3;                                                                                  \
    }                                                                                                                  \
    API int fmi3Set##NAME(void *v, const VR r[], size_t n, const TYPE in[], size_t n_in)                               \
    {                                                                                                                  \
        size_t count, done = 0;                                                                                        \
        for (size_t k = 0; k < n; k++) {                                                                               \
            TYPE *to = place_##NAME(v, r[k], &count);                                                                  \
            if (!to || done + count > n_in || ((r[k] == 20 || r[k] == 21) != ((Types *)v)->configuring))               \
                return 3;                                                                                              \
            memcpy(to, in + done, count * sizeof *in);                                                                 \
            done += count;                                                                                             \
        }                                                                                                              \
        return done == n_in ? 0 : 3;                                                                                   \
    }
#define SCALAR(NAME, TYPE, REFERENCE)                                                                                  \
    static TYPE *place_##NAME(Types *c, VR r, size_t *count)                                                           \
    {                                                                                                                  \
        *count = 1;                                                                                                    \
        return r == REFERENCE ? &c->NAME : NULL;                                                                       \
    }                                                                                                                  \
    ACCESS(NAME, TYPE)
SCALAR(Float32, float, 0)
SCALAR(Int8, int8_t, 2)
SCALAR(UInt8, uint8_t, 3)
SCALAR(UInt16, uint16_t, 5)
SCALAR(Int32, int32_t, 6)
SCALAR(UInt32, uint32_t, 7)
SCALAR(Boolean, bool, 10)

static double *place_Float64(Types *c, VR r, size_t *count)
{
    static double sum;
    *count = r == 22 ? (size_t)(c->rows * c->columns) : 1;
    if (r == 25) {
        sum = 0;
        for (uint64_t k = 0; k < c->rows * c->columns; k++)
            sum += c->matrix[k];
        return &sum;
    }
    return r == 22 ? c->matrix : r == 1 ? &c->Float64 : NULL;
}
ACCESS(Float64, double)
static int16_t *place_Int16(Types *c, VR r, size_t *count)
{
    *count = r == 23 ? (size_t)c->columns : 1;
    return r == 23 ? c->vector : r == 4 ? &c->Int16 : NULL;
}
ACCESS(Int16, int16_t)
static int64_t *place_Int64(Types *c, VR r, size_t *count)
{
    *count = 1;
    return r == 8 ? &c->Int64 : r == 13 ? &c->item : NULL;
}
ACCESS(Int64, int64_t)
static uint64_t *place_UInt64(Types *c, VR r, size_t *count)
{
    *count = 1;
    return r == 9 ? &c->UInt64 : r == 20 ? &c->rows : r == 21 ? &c->columns : NULL;
}
ACCESS(UInt64, uint64_t)

API int fmi3GetString(void *v, const VR r[], size_t n, String out[], size_t n_out)
{
    Types *c = v;
    if (n != 1 || n_out != (r[0] == 24 ? c->columns : 1))
        return 3;
    for (size_t k = 0; k < n_out; k++)
        out[k] = r[0] == 24 ? c->texts[k] : c->text;
    return 0;
}
API int fmi3SetString(void *v, const VR r[], size_t n, const String in[], size_t n_in)
{
    Types *c = v;
    if (n != 1 || n_in != (r[0] == 24 ? c->columns : 1) || n_in > 8)
        return 3;
    for (size_t k = 0; k < n_in; k++)
        strncpy(r[0] == 24 ? c->texts[k] : c->text, in[k], 255);
    return 0;
}
API int fmi3GetBinary(void *v, const VR r[], size_t n, size_t sizes[], const uint8_t *out[], size_t n_out)
{
    (void)r;
    if (n != 1 || n_out != 1)
        return 3;
    sizes[0] = ((Types *)v)->blob.size;
    out[0] = ((Types *)v)->blob.bytes;
    return 0;
}
API int fmi3SetBinary(void *v, const VR r[], size_t n, const size_t sizes[], const uint8_t *const in[], size_t n_in)
{
    Types *c = v;
    (void)r;
    if (n != 1 || n_in != 1 || sizes[0] > sizeof c->blob.bytes)
        return 3;
    c->blob.size = sizes[0];
    memcpy(c->blob.bytes, in[0], sizes[0]);
    return 0;
}
