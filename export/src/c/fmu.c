/* The robot as an FMI 2.0 co-simulation. All physics is in robot.c; this translates calls.

   A communication step is a whole number of steps of GAPSCOPE_DT. Input: efforts, held over the step. Outputs: measured
   positions and speeds. Parameters: those at the start. A value reference is BLOCK * GAPSCOPE_JOINTS + joint. */

#define GAPSCOPE_HEADER_ONLY
#include "robot.c"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define N GAPSCOPE_JOINTS
#define GUID "@GUID@"
/* 1: resources/residual.bin has the weights of a residual. */
#define HAS_RESIDUAL @RESIDUAL@

enum { EFFORT, POSITION, VELOCITY, START_POSITION, START_VELOCITY, BLOCKS };

/* What FMI 2.0.4 fixes of types and statuses. */
enum { OK, WARNING, DISCARD, FAILED, FATAL };
enum { CO_SIMULATION = 1 };
typedef void (*fmi2_logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    fmi2_logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} fmi2_callbacks;

/* What a saved state holds; copying it copies the robot. */
typedef struct {
    gapscope_state robot;
    double start[2 * N], effort[N];
} moment;

typedef struct {
    moment now;
    gapscope_residual residual;
    fmi2_callbacks callbacks;
    int started;
    char name[256];
} instance;

#ifdef _WIN32
#define API __declspec(dllexport)
#else
#define API
#endif
/* Linked into a program, the functions of several FMUs are told apart by a prefix. */
#ifdef FMI2_FUNCTION_PREFIX
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define FMI(name) JOIN(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI(name) name
#endif

static int fail(const instance *self, const char *text)
{
    if (self->callbacks.logger)
        self->callbacks.logger(self->callbacks.environment, self->name, FAILED, "logStatusError", "%s", text);
    return FAILED;
}

static void restart(instance *self) { gapscope_start(&self->now.robot, self->now.start, self->now.start + N); }

static int digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* The path of a file in the folder of a URI; 0 where it does not fit. */
static int path_of(const char *uri, const char *file, char *path, size_t size)
{
    size_t length = 0;
    if (strncmp(uri, "file:", 5) == 0) uri += 5;
    if (uri[0] == '/' && uri[1] == '/') {
        const char *root = strchr(uri + 2, '/');
        uri = root ? root : uri + 2;
    }
#ifdef _WIN32
    if (uri[0] == '/' && uri[1] != 0 && uri[2] == ':') uri++;
#endif
    for (; *uri; uri++) {
        int high = uri[0] == '%' ? digit(uri[1]) : -1, low = high < 0 ? -1 : digit(uri[2]);
        if (length + 1 >= size) return 0;
        if (low >= 0) uri += 2;
        path[length++] = low >= 0 ? (char)(16 * high + low) : *uri;
    }
    if (length + strlen(file) + 2 > size) return 0;
    path[length++] = '/';
    strcpy(path + length, file);
    return 1;
}

API const char *FMI(fmi2GetTypesPlatform)(void) { return "default"; }
API const char *FMI(fmi2GetVersion)(void) { return "2.0"; }

API void FMI(fmi2FreeInstance)(void *component)
{
    instance *self = component;
    if (!self) return;
    gapscope_residual_free(&self->residual);
    free(self);
}

API void *FMI(fmi2Instantiate)(
    const char *name, int type, const char *guid, const char *resources, const fmi2_callbacks *callbacks, int visible,
    int logging)
{
    instance *self = calloc(1, sizeof *self);
    (void)visible;
    (void)logging;
    if (!self) return NULL;
    if (callbacks) self->callbacks = *callbacks;
    if (name) strncpy(self->name, name, sizeof self->name - 1);
    if (type != CO_SIMULATION) {
        fail(self, "this FMU is for co-simulation; instantiate it as that");
    } else if (!guid || strcmp(guid, GUID) != 0) {
        fail(self, "the GUID is that of another FMU; take modelDescription.xml and the binary from one file");
    } else if (HAS_RESIDUAL) {
        char path[4096];
        if (!resources || !path_of(resources, "residual.bin", path, sizeof path))
            fail(self, "the folder of resources is not given, or its path is too long");
        else if (gapscope_residual_load(&self->residual, path) != 0)
            fail(self, "resources/residual.bin cannot be read; unpack the FMU anew");
        else return self;
    } else {
        return self;
    }
    FMI(fmi2FreeInstance)(self);
    return NULL;
}

API int FMI(fmi2SetDebugLogging)(void *component, int on, size_t count, const char *const *categories)
{
    (void)component, (void)on, (void)count, (void)categories;
    return OK;
}

API int FMI(fmi2SetupExperiment)(void *component, int has_tolerance, double tolerance, double from, int has_end, double to)
{
    (void)component, (void)has_tolerance, (void)tolerance, (void)from, (void)has_end, (void)to;
    return OK;
}

API int FMI(fmi2EnterInitializationMode)(void *component)
{
    restart(component);
    return OK;
}

API int FMI(fmi2ExitInitializationMode)(void *component)
{
    ((instance *)component)->started = 1;
    return OK;
}

API int FMI(fmi2Terminate)(void *component)
{
    (void)component;
    return OK;
}

API int FMI(fmi2Reset)(void *component)
{
    instance *self = component;
    memset(&self->now, 0, sizeof self->now);
    self->started = 0;
    return OK;
}

/* Where a value stands; NULL for a reference that is none. */
static double *at(instance *self, unsigned reference)
{
    unsigned joint = reference % N;
    switch (reference / N) {
    case EFFORT: return &self->now.effort[joint];
    case POSITION: return &self->now.robot.q[joint];
    case VELOCITY: return &self->now.robot.v[joint];
    case START_POSITION: return &self->now.start[joint];
    case START_VELOCITY: return &self->now.start[N + joint];
    default: return NULL;
    }
}

API int FMI(fmi2GetReal)(void *component, const unsigned *references, size_t count, double *values)
{
    size_t i;
    for (i = 0; i < count; i++) {
        const double *value = at(component, references[i]);
        if (!value) return fail(component, "a value reference is none of modelDescription.xml");
        values[i] = *value;
    }
    return OK;
}

API int FMI(fmi2SetReal)(void *component, const unsigned *references, size_t count, const double *values)
{
    instance *self = component;
    size_t i;
    for (i = 0; i < count; i++) {
        unsigned block = references[i] / N;
        if (block >= BLOCKS) return fail(self, "a value reference is none of modelDescription.xml");
        if (block == POSITION || block == VELOCITY)
            return fail(self, "positions and velocities are outputs; set start.position and start.velocity instead");
        if (block != EFFORT && self->started) return fail(self, "a start value cannot change after the initialization");
        *at(self, references[i]) = values[i];
    }
    if (!self->started) restart(self);
    return OK;
}

/* There are no values of these types. */
#define NO_VALUES(type, name)                                                                                          \
    API int FMI(fmi2Get##name)(void *component, const unsigned *references, size_t count, type *values)                \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return count == 0 ? OK : fail(component, "all variables of this FMU are of type Real");                        \
    }                                                                                                                  \
    API int FMI(fmi2Set##name)(void *component, const unsigned *references, size_t count, const type *values)          \
    {                                                                                                                  \
        (void)references, (void)values;                                                                                \
        return count == 0 ? OK : fail(component, "all variables of this FMU are of type Real");                        \
    }
NO_VALUES(int, Integer)
NO_VALUES(int, Boolean)
NO_VALUES(char *, String)

API int FMI(fmi2DoStep)(void *component, double time, double length, int no_set)
{
    instance *self = component;
    double steps = floor(length / GAPSCOPE_DT + 0.5), i;
    (void)time, (void)no_set;
    if (!(steps >= 1.0) || fabs(steps * GAPSCOPE_DT - length) > 1e-6 * GAPSCOPE_DT * steps) {
        char text[160];
        sprintf(text, "the communication step is %.9g s; make it a whole multiple of %.9g s, or export with another --dt",
                length, GAPSCOPE_DT);
        return fail(self, text);
    }
    for (i = 0.0; i < steps; i++) {
        if (HAS_RESIDUAL) gapscope_hybrid_step(&self->now.robot, &self->residual, self->now.effort);
        else gapscope_step(&self->now.robot, self->now.effort);
    }
    for (i = 0.0; i < N; i++)
        if (!(fabs(self->now.robot.q[(int)i]) < HUGE_VAL))
            return fail(self, "a position is no number any more; look at the efforts, or export with a shorter --dt");
    return OK;
}

API int FMI(fmi2GetFMUstate)(void *component, void **state)
{
    if (!*state) *state = malloc(sizeof(moment));
    if (!*state) return fail(component, "there is no memory for a state");
    memcpy(*state, &((instance *)component)->now, sizeof(moment));
    return OK;
}

API int FMI(fmi2SetFMUstate)(void *component, void *state)
{
    memcpy(&((instance *)component)->now, state, sizeof(moment));
    return OK;
}

API int FMI(fmi2FreeFMUstate)(void *component, void **state)
{
    (void)component;
    free(*state);
    *state = NULL;
    return OK;
}

API int FMI(fmi2SerializedFMUstateSize)(void *component, void *state, size_t *size)
{
    (void)component, (void)state;
    *size = sizeof(moment);
    return OK;
}

API int FMI(fmi2SerializeFMUstate)(void *component, void *state, char *bytes, size_t size)
{
    if (size < sizeof(moment)) return fail(component, "the buffer is shorter than a state");
    memcpy(bytes, state, sizeof(moment));
    return OK;
}

API int FMI(fmi2DeSerializeFMUstate)(void *component, const char *bytes, size_t size, void **state)
{
    if (size != sizeof(moment)) return fail(component, "these bytes are no state of this FMU");
    *state = malloc(sizeof(moment));
    if (!*state) return fail(component, "there is no memory for a state");
    memcpy(*state, bytes, sizeof(moment));
    return OK;
}

API int FMI(fmi2GetDirectionalDerivative)(
    void *component, const unsigned *unknown, size_t unknowns, const unsigned *known, size_t knowns, const double *change,
    double *result)
{
    (void)unknown, (void)unknowns, (void)known, (void)knowns, (void)change, (void)result;
    return fail(component, "this FMU has no directional derivatives");
}

API int FMI(fmi2SetRealInputDerivatives)(
    void *component, const unsigned *references, size_t count, const int *order, const double *values)
{
    (void)references, (void)count, (void)order, (void)values;
    return fail(component, "this FMU holds its inputs over a step");
}

API int FMI(fmi2GetRealOutputDerivatives)(
    void *component, const unsigned *references, size_t count, const int *order, double *values)
{
    (void)references, (void)count, (void)order, (void)values;
    return fail(component, "this FMU has no derivatives of outputs");
}

API int FMI(fmi2CancelStep)(void *component) { return fail(component, "no step is under way"); }

#define NO_STATUS(type, name)                                                                                          \
    API int FMI(name)(void *component, int kind, type *value)                                                          \
    {                                                                                                                  \
        (void)component, (void)kind, (void)value;                                                                      \
        return DISCARD;                                                                                                \
    }
NO_STATUS(int, fmi2GetStatus)
NO_STATUS(double, fmi2GetRealStatus)
NO_STATUS(int, fmi2GetIntegerStatus)
NO_STATUS(int, fmi2GetBooleanStatus)
NO_STATUS(char *, fmi2GetStringStatus)
