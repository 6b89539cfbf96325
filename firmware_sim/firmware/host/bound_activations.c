/* Calls of one firmware's functions, and of what it calls from within them; bound_activations.pyi has the contract.
 *
 *     timer, receive --> host_timer, host_receive --`host.call`--> carry_out: send, write, carry_out of the Carrier
 *                            --`host.ask`--> ask: carry_out, then read or answer of the Carrier
 *
 * ctypes_activations.py does the same by ctypes, which prepares each call and each question anew. There the Carrier
 * carries out all calls; here SEND and ACTUATE, the most frequent ones, go to its ports and actuators without it.
 *
 * `busy` keeps the library loaded and the references held while Python code runs that could call `close`.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <stdbool.h>
#include <stdint.h>

#include "marconet_host.h"

enum { OK = 0, NO_VALUE = -4 };         /* BoardError of marconet_board.h */

/* A data pointer and a pointer to a function have one size wherever firmware is loaded at run time (POSIX, Windows). */
typedef union {
    void *address;
    int (*call)(void);
    int (*take)(const uint8_t *frame);
} Function;

typedef struct {
    PyObject_HEAD
    Host *host;                         /* NULL after `close` */
    Function start, timer, receive;
    bool ours;
    bool busy;                          /* within an activation */
    PyObject *now, *carry_out, *answer, *written, *keep;
    PyObject *read, *write, *send;      /* tuples, copied: nobody can change them during a call */
    PyObject *error;                    /* raised while a question was answered; NULL: none */
} Activations;

/* --- the calls of the firmware */

static int done(PyObject *result)
{
    Py_XDECREF(result);
    return result ? 0 : -1;
}

static int actuate(const Activations *self, const Call *call)
{
    PyObject *value = PyFloat_FromDouble(call->real), *values = value ? PyTuple_Pack(1, value) : NULL;
    int failed = -1;
    if (values && PyList_SetItem(self->written, call->id, Py_NewRef(value)) == 0)
        failed = done(PyObject_CallOneArg(PyTuple_GET_ITEM(self->write, call->id), values));
    Py_XDECREF(value);
    Py_XDECREF(values);
    return failed;
}

static int send_frame(const Activations *self, const Call *call)
{
    PyObject *frame = PyBytes_FromStringAndSize((const char *)self->host->bytes + call->place, call->integer);
    if (!frame)
        return -1;
    const int failed = done(PyObject_CallOneArg(PyTuple_GET_ITEM(self->send, call->id), frame));
    Py_DECREF(frame);
    return failed;
}

/* Return what a Carrier is given: a tuple with one Call. */
static PyObject *as_tuple(const Call *call)
{
    PyObject *calls = PyTuple_New(1), *values = PyTuple_New(5);
    PyObject *const entries[5] = {PyLong_FromUnsignedLong(call->operation), PyLong_FromUnsignedLong(call->id),
                                  PyLong_FromLongLong(call->integer), PyLong_FromLongLong(call->place),
                                  PyFloat_FromDouble(call->real)};
    for (Py_ssize_t k = 0; k < 5; k++) {
        if (values)
            PyTuple_SET_ITEM(values, k, entries[k]);
        else
            Py_XDECREF(entries[k]);
    }
    if (calls && values) {
        PyTuple_SET_ITEM(calls, 0, values);
    } else {
        Py_CLEAR(calls);
        Py_XDECREF(values);
    }
    if (PyErr_Occurred())
        Py_CLEAR(calls);
    return calls;
}

static int hand_over(const Activations *self, const Call *call)
{
    PyObject *calls = as_tuple(call);
    if (!calls)
        return -1;
    const int failed = done(PyObject_CallOneArg(self->carry_out, calls));
    Py_DECREF(calls);
    return failed;
}

static int carry_out(const Activations *self)
{
    const Host *host = self->host;
    for (const Call *call = host->call; call < host->call + host->calls; call++) {
        int failed;
        if (call->operation == ACTUATE && call->id < (size_t)PyTuple_GET_SIZE(self->write))
            failed = actuate(self, call);
        else if (call->operation == SEND && call->integer >= 0 && call->id < (size_t)PyTuple_GET_SIZE(self->send))
            failed = send_frame(self, call);
        else
            failed = hand_over(self, call);
        if (failed)
            return -1;
    }
    return 0;
}

/* --- the questions of the firmware */

static int read_clock(const Activations *self)
{
    PyObject *now = PyObject_CallNoArgs(self->now);
    if (!now)
        return -1;
    int beyond = 0;
    const long long now_ns = PyLong_AsLongLongAndOverflow(now, &beyond);
    if (beyond)
        PyErr_Format(PyExc_ValueError, "a local time of %R ns: expected one of 64 bits", now);
    Py_DECREF(now);
    self->host->now = now_ns;
    return PyErr_Occurred() ? -1 : 0;
}

/* Return the answer to a question of the firmware, a new reference; Py_None if there is no such value. */
static PyObject *found(const Activations *self)
{
    const Host *host = self->host;
    PyObject *answer;
    if (host->question == HAND_OVER)
        return PyFloat_FromDouble(0.0);
    if (host->question == SENSE) {
        if (host->asked_id >= (size_t)PyTuple_GET_SIZE(self->read))
            return PyErr_Format(PyExc_IndexError, "sensor %u: there are %zd", host->asked_id,
                                PyTuple_GET_SIZE(self->read));
        return PyObject_CallNoArgs(PyTuple_GET_ITEM(self->read, host->asked_id));
    }
    answer = PyObject_CallFunction(self->answer, "IILd", host->question, host->asked_id,
                                   (long long)host->asked_integer, host->asked_real);
    if (answer && host->question == ADJUST_CLOCK && read_clock(self) < 0)
        Py_CLEAR(answer);
    return answer;
}

static void keep_error(Activations *self)
{
#if PY_VERSION_HEX >= 0x030C0000
    self->error = PyErr_GetRaisedException();
#else
    PyObject *type, *traceback;
    PyErr_Fetch(&type, &self->error, &traceback);
    PyErr_NormalizeException(&type, &self->error, &traceback);
    if (traceback)
        PyException_SetTraceback(self->error, traceback);
    Py_XDECREF(type);
    Py_XDECREF(traceback);
#endif
}

static int raise_kept(Activations *self)
{
    PyObject *error = self->error;
    self->error = NULL;
#if PY_VERSION_HEX >= 0x030C0000
    PyErr_SetRaisedException(error);
#else
    PyErr_Restore(Py_NewRef(Py_TYPE(error)), error, PyException_GetTraceback(error));
#endif
    return -1;
}

static void answer_question(Activations *self)
{
    Host *host = self->host;
    host->code = NO_VALUE;
    if (self->error)
        return;
    PyObject *answer = carry_out(self) < 0 ? NULL : found(self);
    if (answer && answer != Py_None) {
        host->asked_real = PyFloat_AsDouble(answer);
        host->code = OK;
    }
    Py_XDECREF(answer);
    if (PyErr_Occurred()) {
        host->code = NO_VALUE;
        keep_error(self);
    }
}

/* Called by the firmware while one of its functions runs, in that function's thread or one that it waits for. */
static void ask(void *context)
{
    Activations *self = context;
    if (self->ours) {
        answer_question(self);
        return;
    }
    const PyGILState_STATE before = PyGILState_Ensure();
    answer_question(self);
    PyGILState_Release(before);
}

/* --- activations */

static int not_busy(const Activations *self)
{
    if (!self->busy)
        return 0;
    PyErr_SetString(PyExc_RuntimeError, "a function of the firmware runs, or its calls are being carried out: expected "
                                        "after that");
    return -1;
}

static int call_firmware(Activations *self, Function function, const uint8_t *frame)
{
    if (self->ours) {
        frame ? function.take(frame) : function.call();
    } else {
        Py_BEGIN_ALLOW_THREADS
        frame ? function.take(frame) : function.call();
        Py_END_ALLOW_THREADS
    }
    return self->error ? raise_kept(self) : carry_out(self);
}

static int activate(Activations *self, Function function, uint32_t id, const uint8_t *frame, uint32_t length)
{
    if (not_busy(self) < 0)
        return -1;
    if (!self->host) {
        PyErr_SetString(PyExc_RuntimeError, "the firmware is not loaded any more: its node has ended");
        return -1;
    }
    self->busy = true;
    int failed = read_clock(self);
    if (!failed) {
        self->host->id = id;
        self->host->length = length;
        failed = call_firmware(self, function, frame);
    }
    self->busy = false;
    return failed;
}

/* Set `id` to a number of a timer or a port. */
static int number_of(PyObject *given, uint32_t *id)
{
    const long long number = PyLong_AsLongLong(given);
    if (number == -1 && PyErr_Occurred() && !PyErr_ExceptionMatches(PyExc_OverflowError))
        return -1;
    if (number < 0 || number > UINT32_MAX) {
        PyErr_Format(PyExc_ValueError, "%R: expected a number of 32 bits", given);
        return -1;
    }
    *id = (uint32_t)number;
    return 0;
}

static PyObject *do_start(PyObject *object, PyObject *unused)
{
    (void)unused;
    Activations *self = (Activations *)object;
    return activate(self, self->start, 0, NULL, 0) < 0 ? NULL : PyLong_FromLong(self->host->code);
}

static PyObject *do_timer(PyObject *object, PyObject *timer)
{
    Activations *self = (Activations *)object;
    uint32_t id;
    if (number_of(timer, &id) < 0 || activate(self, self->timer, id, NULL, 0) < 0)
        return NULL;
    Py_RETURN_NONE;
}

static PyObject *do_receive(PyObject *object, PyObject *const *arguments, Py_ssize_t count)
{
    Activations *self = (Activations *)object;
    uint32_t port;
    char *frame;
    Py_ssize_t length;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "%zd arguments: expected a port and a frame", count);
    if (number_of(arguments[0], &port) < 0 || PyBytes_AsStringAndSize(arguments[1], &frame, &length) < 0)
        return NULL;
    if (length > UINT32_MAX)
        return PyErr_Format(PyExc_ValueError, "a frame of %zd bytes: expected a length of 32 bits", length);
    if (activate(self, self->receive, port, (const uint8_t *)frame, (uint32_t)length) < 0)
        return NULL;
    Py_RETURN_NONE;
}

/* --- the life of an object */

static int clear(PyObject *object)
{
    Activations *self = (Activations *)object;
    self->host = NULL;
    Py_CLEAR(self->now);
    Py_CLEAR(self->carry_out);
    Py_CLEAR(self->answer);
    Py_CLEAR(self->written);
    Py_CLEAR(self->keep);
    Py_CLEAR(self->read);
    Py_CLEAR(self->write);
    Py_CLEAR(self->send);
    Py_CLEAR(self->error);
    return 0;
}

static int traverse(PyObject *object, visitproc visit, void *arg)
{
    const Activations *self = (Activations *)object;
    Py_VISIT(Py_TYPE(object));
    Py_VISIT(self->now);
    Py_VISIT(self->carry_out);
    Py_VISIT(self->answer);
    Py_VISIT(self->written);
    Py_VISIT(self->keep);
    Py_VISIT(self->read);
    Py_VISIT(self->write);
    Py_VISIT(self->send);
    Py_VISIT(self->error);
    return 0;
}

static void dealloc(PyObject *object)
{
    PyTypeObject *type = Py_TYPE(object);
    PyObject_GC_UnTrack(object);
    clear(object);
    type->tp_free(object);
    Py_DECREF(type);
}

static PyObject *do_close(PyObject *object, PyObject *unused)
{
    (void)unused;
    if (not_busy((Activations *)object) < 0)
        return NULL;
    clear(object);
    Py_RETURN_NONE;
}

static PyObject *copy_of(PyObject *calls, const char *name)
{
    PyObject *functions = PyObject_GetAttrString(calls, name), *copy = functions ? PySequence_Tuple(functions) : NULL;
    Py_XDECREF(functions);
    return copy;
}

static PyObject *new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    static char *names[] = {"memory", "start", "timer", "receive", "now", "calls", "keep", "ours", NULL};
    unsigned long long memory, start, timer, receive;
    PyObject *now, *calls, *keep;
    int ours;
    if (!PyArg_ParseTupleAndKeywords(arguments, keywords, "KKKKOOOp", names, &memory, &start, &timer, &receive, &now,
                                     &calls, &keep, &ours))
        return NULL;
    Activations *self = (Activations *)type->tp_alloc(type, 0);
    if (!self)
        return NULL;
    self->start.address = (void *)(uintptr_t)start;
    self->timer.address = (void *)(uintptr_t)timer;
    self->receive.address = (void *)(uintptr_t)receive;
    self->ours = ours;
    self->now = Py_NewRef(now);
    self->keep = Py_NewRef(keep);
    if (!(self->carry_out = PyObject_GetAttrString(calls, "carry_out"))
        || !(self->answer = PyObject_GetAttrString(calls, "answer"))
        || !(self->written = PyObject_GetAttrString(calls, "written")) || !(self->read = copy_of(calls, "read"))
        || !(self->write = copy_of(calls, "write")) || !(self->send = copy_of(calls, "send"))) {
        Py_DECREF(self);
        return NULL;
    }
    self->host = (Host *)(uintptr_t)memory;
    self->host->ask = ask;
    self->host->context = self;
    return (PyObject *)self;
}

static PyMethodDef methods[] = {
    {"start", do_start, METH_NOARGS, NULL},
    {"timer", do_timer, METH_O, NULL},
    {"receive", (PyCFunction)(void (*)(void))do_receive, METH_FASTCALL, NULL},
    {"close", do_close, METH_NOARGS, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot type_slots[] = {
    {Py_tp_new, new}, {Py_tp_dealloc, dealloc}, {Py_tp_traverse, traverse}, {Py_tp_clear, clear},
    {Py_tp_methods, methods}, {0, NULL},
};
static PyType_Spec type_spec = {"firmware_sim.firmware.host.bound_activations.Activations", sizeof(Activations), 0,
                                Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, type_slots};

static int add_type(PyObject *module)
{
    PyObject *type = PyType_FromSpec(&type_spec);
    const int failed = !type || PyModule_AddObjectRef(module, "Activations", type) < 0;
    Py_XDECREF(type);
    return failed ? -1 : 0;
}

static PyModuleDef_Slot slots[] = {{Py_mod_exec, add_type}, {0, NULL}};
static PyModuleDef module = {PyModuleDef_HEAD_INIT, "bound_activations", NULL, 0, NULL, slots, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit_bound_activations(void)
{
    return PyModuleDef_Init(&module);
}
