/* Batons between threads of which one runs at a time; c_batons.pyi has the Python contract.
 *
 *     pass_on:  interpreter's lock given up --> `to` given --> `own` awaited --> interpreter's lock taken
 *
 * With one call to give a baton and another to wait, a thread still holds the interpreter's lock when the thread that it
 * has woken needs it: that thread has to wait again, and a change of threads becomes two or three.
 * python_batons.py has these two calls.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <pythread.h>
#include <time.h>

static const double LONGEST_S = 9223372036.0;           /* threading.TIMEOUT_MAX */

/* A lock that is taken from the start: who gives the baton releases it, who takes the baton acquires it. */
typedef struct {
    PyObject_HEAD
    PyThread_type_lock lock;
} Baton;

typedef struct {
    PyTypeObject *baton;
} State;

static long long now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000LL + now.tv_nsec / 1000;
}

static PyObject *baton_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    static char *names[] = {NULL};
    if (!PyArg_ParseTupleAndKeywords(arguments, keywords, "", names))
        return NULL;
    Baton *self = (Baton *)type->tp_alloc(type, 0);
    if (!self)
        return NULL;
    self->lock = PyThread_allocate_lock();
    if (!self->lock) {
        Py_DECREF(self);
        return PyErr_NoMemory();
    }
    PyThread_acquire_lock(self->lock, NOWAIT_LOCK);
    return (PyObject *)self;
}

static void baton_dealloc(PyObject *object)
{
    Baton *self = (Baton *)object;
    if (self->lock)
        PyThread_free_lock(self->lock);
    PyTypeObject *type = Py_TYPE(object);
    type->tp_free(object);
    Py_DECREF(type);
}

/* Give `to`, if there is one, and wait for `own`; the caller keeps both alive. */
static PyObject *await_baton(Baton *to, Baton *own, PyObject *timeout)
{
    const double timeout_s = timeout ? PyFloat_AsDouble(timeout) : -1;
    if (timeout_s == -1 && PyErr_Occurred())
        return NULL;
    if (!(timeout_s <= LONGEST_S))              /* or not a number */
        return PyErr_Format(PyExc_OverflowError, "timeout_s=%R: expected at most 9223372036 s", timeout);
    const long long end_us = timeout_s < 0 ? 0 : now_us() + (long long)(timeout_s * 1e6);
    for (;;) {
        const long long left_us = timeout_s < 0 ? -1 : end_us - now_us();
        PyLockStatus status;
        Py_BEGIN_ALLOW_THREADS
        if (to)
            PyThread_release_lock(to->lock);
        status = PyThread_acquire_lock_timed(own->lock, timeout_s < 0 ? -1 : Py_MAX(left_us, 0), 1);
        Py_END_ALLOW_THREADS
        to = NULL;
        if (status == PY_LOCK_ACQUIRED)
            Py_RETURN_TRUE;
        if (status == PY_LOCK_FAILURE)
            Py_RETURN_FALSE;
        if (PyErr_CheckSignals())               /* the wait was interrupted by a signal */
            return NULL;
    }
}

static PyObject *baton_give(PyObject *object, PyObject *unused)
{
    (void)unused;
    PyThread_release_lock(((Baton *)object)->lock);
    Py_RETURN_NONE;
}

static PyObject *baton_take(PyObject *object, PyObject *const *arguments, Py_ssize_t count)
{
    if (count > 1)
        return PyErr_Format(PyExc_TypeError, "%zd arguments: expected timeout_s or none", count);
    return await_baton(NULL, (Baton *)object, count ? arguments[0] : NULL);
}

static PyObject *pass_on(PyObject *module, PyObject *const *arguments, Py_ssize_t count)
{
    PyTypeObject *baton = ((State *)PyModule_GetState(module))->baton;
    if (count < 2 || count > 3 || !Py_IS_TYPE(arguments[0], baton) || !Py_IS_TYPE(arguments[1], baton)) {
        PyErr_SetString(PyExc_TypeError, "expected two batons and timeout_s or none");
        return NULL;
    }
    return await_baton((Baton *)arguments[0], (Baton *)arguments[1], count > 2 ? arguments[2] : NULL);
}

static PyMethodDef baton_methods[] = {
    {"give", baton_give, METH_NOARGS, NULL},
    {"take", (PyCFunction)(void (*)(void))baton_take, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot baton_slots[] = {
    {Py_tp_new, baton_new}, {Py_tp_dealloc, baton_dealloc}, {Py_tp_methods, baton_methods}, {0, NULL},
};
static PyType_Spec baton_type = {"firmware_sim.blocking.c_batons.Baton", sizeof(Baton), 0, Py_TPFLAGS_DEFAULT,
                                 baton_slots};

static int add_type(PyObject *module)
{
    State *state = PyModule_GetState(module);
    state->baton = (PyTypeObject *)PyType_FromSpec(&baton_type);
    return state->baton ? PyModule_AddObjectRef(module, "Baton", (PyObject *)state->baton) : -1;
}

static int visit_state(PyObject *module, visitproc visit, void *arg)
{
    Py_VISIT(((State *)PyModule_GetState(module))->baton);
    return 0;
}

static int clear_state(PyObject *module)
{
    Py_CLEAR(((State *)PyModule_GetState(module))->baton);
    return 0;
}

static PyMethodDef functions[] = {
    {"pass_on", (PyCFunction)(void (*)(void))pass_on, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};
static PyModuleDef_Slot slots[] = {{Py_mod_exec, add_type}, {0, NULL}};
static PyModuleDef module = {PyModuleDef_HEAD_INIT, "c_batons", NULL, sizeof(State), functions, slots, visit_state,
                             clear_state, NULL};

PyMODINIT_FUNC PyInit_c_batons(void)
{
    return PyModuleDef_Init(&module);
}
