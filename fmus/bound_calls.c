/* Calls of an FMU's functions, all arguments but numbers bound beforehand; bound_calls.pyi has the Python contract.
 *
 *     BoundStep    fmi2DoStep, fmi3DoStep
 *     BoundValues  fmi2SetReal, fmi3SetFloat64, fmi2GetReal, fmi3GetFloat64
 *
 * ctypes_calls.py does the same by ctypes, which prepares the arguments anew at every call.
 * An instance belongs to one thread at a time, as FMI requires. A call without `brief` releases the interpreter lock.
 * While a call runs, the word given to `watch` holds its number, so that another process knows the call after a crash.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#include <stdbool.h>
#include <stdint.h>

typedef int (*Step2)(void *, double, double, int);
typedef int (*Step3)(void *, double, double, bool, bool *, bool *, bool *, double *);
typedef int (*Values2)(void *, const unsigned *, size_t, double *);
typedef int (*Values3)(void *, const unsigned *, size_t, double *, size_t);

enum { WARNING = 1 };

/* A data pointer and a pointer to a function have one size wherever FMUs are loaded at run time (POSIX, Windows). */
typedef union {
    void *address;
    Step2 step2;
    Step3 step3;
    Values2 values2;
    Values3 values3;
} Function;

typedef struct {
    volatile int64_t *word;
    int64_t number;
    int64_t own;            /* `word` points here until `watch` names another */
    Py_buffer view;         /* of the word that `watch` named */
} Record;

typedef struct {
    PyObject_HEAD
    Function function;
    void *instance;
    int fmi;
    int brief;
    Record record;
    bool asks_to_end, early, event;
    double last;
} BoundStep;

typedef struct {
    PyObject_HEAD
    Function function;
    void *instance;
    int fmi;
    int brief;
    Record record;
    Py_ssize_t count;
    unsigned *references;
    double *values;
} BoundValues;

static int known_version(int fmi)
{
    if (fmi == 2 || fmi == 3)
        return 1;
    PyErr_Format(PyExc_ValueError, "fmi=%d: expected 2 or 3", fmi);
    return 0;
}

static PyObject *watch(Record *record, PyObject *arguments)
{
    Py_buffer view;
    long long number;
    if (!PyArg_ParseTuple(arguments, "w*L", &view, &number))
        return NULL;
    if (view.len != sizeof *record->word || (uintptr_t)view.buf % sizeof *record->word) {
        PyBuffer_Release(&view);
        return PyErr_Format(PyExc_ValueError, "%zd bytes: expected one aligned 64-bit word", view.len);
    }
    PyBuffer_Release(&record->view);
    record->view = view;
    record->word = view.buf;
    record->number = number;
    Py_RETURN_NONE;
}

static PyObject *step_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    static char *names[] = {"function", "instance", "fmi", "brief", NULL};
    unsigned long long function, instance;
    int fmi, brief;
    if (!PyArg_ParseTupleAndKeywords(arguments, keywords, "KKip", names, &function, &instance, &fmi, &brief)
        || !known_version(fmi))
        return NULL;
    BoundStep *self = (BoundStep *)type->tp_alloc(type, 0);
    if (!self)
        return NULL;
    self->function.address = (void *)(uintptr_t)function;
    self->instance = (void *)(uintptr_t)instance;
    self->fmi = fmi;
    self->brief = brief;
    self->record.word = &self->record.own;
    self->last = Py_NAN;
    return (PyObject *)self;
}

static int call_step(BoundStep *self, double time, double h)
{
    int status;
    *self->record.word = self->record.number;
    if (self->fmi == 2)
        status = self->function.step2(self->instance, time, h, 1);
    else
        status = self->function.step3(self->instance, time, h, true, &self->event, &self->asks_to_end, &self->early,
                                      &self->last);
    *self->record.word = 0;
    return status;
}

static PyObject *step_do(PyObject *object, PyObject *const *arguments, Py_ssize_t count)
{
    BoundStep *self = (BoundStep *)object;
    int status;
    if (count != 2)
        return PyErr_Format(PyExc_TypeError, "%zd arguments: expected time and h", count);
    const double time = PyFloat_AsDouble(arguments[0]), h = PyFloat_AsDouble(arguments[1]);
    if ((time == -1 || h == -1) && PyErr_Occurred())
        return NULL;
    if (self->brief) {
        status = call_step(self, time, h);
    } else {
        Py_BEGIN_ALLOW_THREADS
        status = call_step(self, time, h);
        Py_END_ALLOW_THREADS
    }
    return PyErr_Occurred() ? NULL : PyLong_FromLong(status);
}

static PyObject *step_ended(PyObject *object, void *closure)
{
    (void)closure;
    return PyBool_FromLong(((BoundStep *)object)->asks_to_end || ((BoundStep *)object)->early);
}

static PyObject *step_asks_to_end(PyObject *object, void *closure)
{
    (void)closure;
    return PyBool_FromLong(((BoundStep *)object)->asks_to_end);
}

static PyObject *step_early(PyObject *object, void *closure)
{
    (void)closure;
    return PyBool_FromLong(((BoundStep *)object)->early);
}

static PyObject *step_needs_event(PyObject *object, void *closure)
{
    (void)closure;
    return PyBool_FromLong(((BoundStep *)object)->event);
}

static PyObject *values_new(PyTypeObject *type, PyObject *arguments, PyObject *keywords)
{
    static char *names[] = {"function", "instance", "references", "fmi", "brief", NULL};
    unsigned long long function, instance;
    PyObject *given, *references;
    int fmi, brief;
    if (!PyArg_ParseTupleAndKeywords(arguments, keywords, "KKOip", names, &function, &instance, &given, &fmi, &brief)
        || !known_version(fmi))
        return NULL;
    references = PySequence_Tuple(given); /* a copy: converting a number may run Python, which could change `given` */
    if (!references)
        return NULL;
    const Py_ssize_t count = PyTuple_GET_SIZE(references);
    BoundValues *self = (BoundValues *)type->tp_alloc(type, 0);
    if (self) {
        self->function.address = (void *)(uintptr_t)function;
        self->instance = (void *)(uintptr_t)instance;
        self->fmi = fmi;
        self->brief = brief;
        self->record.word = &self->record.own;
        self->count = count;
        self->references = PyMem_Calloc((size_t)count + 1, sizeof *self->references);
        self->values = PyMem_Calloc((size_t)count + 1, sizeof *self->values);
        if (!self->references || !self->values)
            PyErr_NoMemory();
        for (Py_ssize_t k = 0; k < count && !PyErr_Occurred(); k++)
            self->references[k] = (unsigned)PyLong_AsUnsignedLong(PyTuple_GET_ITEM(references, k));
        if (PyErr_Occurred())
            Py_CLEAR(self);
    }
    Py_DECREF(references);
    return (PyObject *)self;
}

static void values_dealloc(PyObject *object)
{
    BoundValues *self = (BoundValues *)object;
    PyBuffer_Release(&self->record.view);
    PyMem_Free(self->references);
    PyMem_Free(self->values);
    PyTypeObject *type = Py_TYPE(object);
    type->tp_free(object);
    Py_DECREF(type);
}

static int call_values(BoundValues *self)
{
    const size_t count = (size_t)self->count;
    int status;
    *self->record.word = self->record.number;
    if (self->fmi == 2)
        status = self->function.values2(self->instance, self->references, count, self->values);
    else
        status = self->function.values3(self->instance, self->references, count, self->values, count);
    *self->record.word = 0;
    return status;
}

static int exchange(BoundValues *self)
{
    int status;
    if (self->brief)
        return call_values(self);
    Py_BEGIN_ALLOW_THREADS
    status = call_values(self);
    Py_END_ALLOW_THREADS
    return status;
}

static PyObject *values_set(PyObject *object, PyObject *given)
{
    BoundValues *self = (BoundValues *)object;
    PyObject *values = PySequence_Tuple(given);
    if (!values)
        return NULL;
    if (PyTuple_GET_SIZE(values) != self->count)
        PyErr_Format(PyExc_TypeError, "%zd values: expected %zd", PyTuple_GET_SIZE(values), self->count);
    for (Py_ssize_t k = 0; k < self->count && !PyErr_Occurred(); k++)
        self->values[k] = PyFloat_AsDouble(PyTuple_GET_ITEM(values, k));
    Py_DECREF(values);
    if (PyErr_Occurred())
        return NULL;
    const int status = exchange(self);
    return PyErr_Occurred() ? NULL : PyLong_FromLong(status);
}

static PyObject *values_get(PyObject *object, PyObject *unused)
{
    (void)unused;
    BoundValues *self = (BoundValues *)object;
    const int status = exchange(self);
    if (PyErr_Occurred())
        return NULL;
    if (status > WARNING || status < 0)
        return PyLong_FromLong(status);
    PyObject *values = PyTuple_New(self->count);
    for (Py_ssize_t k = 0; values && k < self->count; k++) {
        PyObject *value = PyFloat_FromDouble(self->values[k]);
        if (!value)
            Py_CLEAR(values);
        else
            PyTuple_SET_ITEM(values, k, value);
    }
    return values;
}

static PyObject *step_watch(PyObject *object, PyObject *arguments)
{
    return watch(&((BoundStep *)object)->record, arguments);
}

static PyObject *values_watch(PyObject *object, PyObject *arguments)
{
    return watch(&((BoundValues *)object)->record, arguments);
}

static void step_dealloc(PyObject *object)
{
    PyBuffer_Release(&((BoundStep *)object)->record.view);
    PyTypeObject *type = Py_TYPE(object);
    type->tp_free(object);
    Py_DECREF(type);
}

static PyMethodDef step_methods[] = {
    {"do", (PyCFunction)(void (*)(void))step_do, METH_FASTCALL, NULL},
    {"watch", step_watch, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL},
};
static PyMemberDef step_members[] = {
    {"last", T_DOUBLE, offsetof(BoundStep, last), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};
static PyGetSetDef step_properties[] = {
    {"ended", step_ended, NULL, NULL, NULL},
    {"asks_to_end", step_asks_to_end, NULL, NULL, NULL},
    {"early", step_early, NULL, NULL, NULL},
    {"needs_event", step_needs_event, NULL, NULL, NULL},
    {NULL, NULL, NULL, NULL, NULL},
};
static PyType_Slot step_slots[] = {
    {Py_tp_new, step_new}, {Py_tp_dealloc, step_dealloc}, {Py_tp_methods, step_methods},
    {Py_tp_members, step_members}, {Py_tp_getset, step_properties}, {0, NULL},
};
static PyType_Spec step_type = {"fmus.bound_calls.BoundStep", sizeof(BoundStep), 0, Py_TPFLAGS_DEFAULT, step_slots};

static PyMethodDef values_methods[] = {
    {"set", values_set, METH_O, NULL},
    {"get", values_get, METH_NOARGS, NULL},
    {"watch", values_watch, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot values_slots[] = {
    {Py_tp_new, values_new}, {Py_tp_dealloc, values_dealloc}, {Py_tp_methods, values_methods}, {0, NULL},
};
static PyType_Spec values_type = {"fmus.bound_calls.BoundValues", sizeof(BoundValues), 0, Py_TPFLAGS_DEFAULT,
                                  values_slots};

static int add_types(PyObject *module)
{
    PyObject *step = PyType_FromSpec(&step_type), *values = PyType_FromSpec(&values_type);
    const int failed = !step || !values || PyModule_AddObjectRef(module, "BoundStep", step) < 0
                       || PyModule_AddObjectRef(module, "BoundValues", values) < 0;
    Py_XDECREF(step);
    Py_XDECREF(values);
    return failed ? -1 : 0;
}

static PyModuleDef_Slot slots[] = {{Py_mod_exec, add_types}, {0, NULL}};
static PyModuleDef module = {PyModuleDef_HEAD_INIT, "bound_calls", NULL, 0, NULL, slots, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit_bound_calls(void)
{
    return PyModuleDef_Init(&module);
}
