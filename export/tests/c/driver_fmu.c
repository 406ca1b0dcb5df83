/* Drives the functions of FMI 2.0 as a simulator does. */
#define GAPSCOPE_HEADER_ONLY
#include "robot.c"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define N GAPSCOPE_JOINTS
#ifdef FMI2_FUNCTION_PREFIX
#define FMI(name) robot_##name
#else
#define FMI(name) name
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} callbacks;

void *FMI(fmi2Instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int);
void FMI(fmi2FreeInstance)(void *);
int FMI(fmi2SetupExperiment)(void *, int, double, double, int, double);
int FMI(fmi2EnterInitializationMode)(void *);
int FMI(fmi2ExitInitializationMode)(void *);
int FMI(fmi2Reset)(void *);
int FMI(fmi2GetReal)(void *, const unsigned *, size_t, double *);
int FMI(fmi2SetReal)(void *, const unsigned *, size_t, const double *);
int FMI(fmi2DoStep)(void *, double, double, int);
int FMI(fmi2GetFMUstate)(void *, void **);
int FMI(fmi2SetFMUstate)(void *, void *);
int FMI(fmi2FreeFMUstate)(void *, void **);
int FMI(fmi2SerializedFMUstateSize)(void *, void *, size_t *);
int FMI(fmi2SerializeFMUstate)(void *, void *, char *, size_t);
int FMI(fmi2DeSerializeFMUstate)(void *, const char *, size_t, void **);

static char said[512];

static void logger(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    va_list rest;
    (void)environment, (void)name, (void)status, (void)category;
    va_start(rest, message);
    vsprintf(said, message, rest);
    va_end(rest);
}

static int numbers(double *x, int count)
{
    int j;
    for (j = 0; j < count; j++)
        if (scanf("%lf", &x[j]) != 1) return 0;
    return 1;
}

static unsigned all(unsigned block, unsigned *references)
{
    unsigned j;
    for (j = 0; j < 2 * N; j++) references[j] = block * N + j;
    return 2 * N;
}

static int start(void *fmu, const double *x)
{
    unsigned references[2 * N], count = all(3, references);
    double shown[2 * N];
    FMI(fmi2Reset)(fmu);
    FMI(fmi2SetupExperiment)(fmu, 0, 0.0, 0.0, 0, 0.0);
    if (FMI(fmi2SetReal)(fmu, references, count, x) || FMI(fmi2EnterInitializationMode)(fmu)) return 1;
    all(1, references);
    if (FMI(fmi2GetReal)(fmu, references, count, shown) || memcmp(shown, x, sizeof shown)) return 1;
    return FMI(fmi2ExitInitializationMode)(fmu);
}

static int step(void *fmu, const double *tau, double length, double *x)
{
    unsigned references[2 * N], count = all(0, references);
    if (FMI(fmi2SetReal)(fmu, references, count / 2, tau)) return 1;
    if (FMI(fmi2DoStep)(fmu, 0.0, length, 1)) return 1;
    all(1, references);
    return FMI(fmi2GetReal)(fmu, references, count, x);
}

/* A 1 for each promise that is kept. */
static void check(void *fmu, const callbacks *calls)
{
    double x[2 * N] = { 0 }, tau[N] = { 0 }, once[2 * N], twice[2 * N], again[2 * N];
    unsigned reference = 5 * N;
    size_t size = 0;
    void *state = NULL, *copy = NULL;
    static char bytes[65536];
    int kept[9], i;
    tau[0] = 1.0;
    start(fmu, x);
    FMI(fmi2GetFMUstate)(fmu, &state);
    FMI(fmi2SerializedFMUstateSize)(fmu, state, &size);
    kept[0] = size <= sizeof bytes && FMI(fmi2SerializeFMUstate)(fmu, state, bytes, size) == 0;
    step(fmu, tau, GAPSCOPE_DT, once);
    step(fmu, tau, GAPSCOPE_DT, once);
    FMI(fmi2SetFMUstate)(fmu, state);
    step(fmu, tau, 2.0 * GAPSCOPE_DT, twice);
    kept[1] = memcmp(once, twice, sizeof once) == 0;
    FMI(fmi2DeSerializeFMUstate)(fmu, bytes, size, &copy);
    FMI(fmi2SetFMUstate)(fmu, copy);
    step(fmu, tau, 2.0 * GAPSCOPE_DT, again);
    kept[2] = memcmp(again, twice, sizeof again) == 0;
    said[0] = 0;
    kept[3] = FMI(fmi2DoStep)(fmu, 0.0, 1.5 * GAPSCOPE_DT, 1) == 3 && strstr(said, "whole multiple") != NULL;
    kept[4] = FMI(fmi2GetReal)(fmu, &reference, 1, x) == 3 && FMI(fmi2SetReal)(fmu, &reference, 1, x) == 3;
    reference = N;
    kept[5] = FMI(fmi2SetReal)(fmu, &reference, 1, x) == 3 && strstr(said, "are outputs") != NULL;
    reference = 3 * N;
    kept[6] = FMI(fmi2SetReal)(fmu, &reference, 1, x) == 3 && strstr(said, "after the initialization") != NULL;
    kept[7] = FMI(fmi2Instantiate)("r", 1, "another", "file:///none", calls, 0, 0) == NULL && strstr(said, "GUID") != NULL;
    FMI(fmi2FreeFMUstate)(fmu, &state);
    FMI(fmi2FreeFMUstate)(fmu, &copy);
    kept[8] = state == NULL && copy == NULL;
    for (i = 0; i < 9; i++) printf(i ? " %d" : "%d", kept[i]);
    printf("\n");
}

int main(void)
{
    callbacks calls = { logger, NULL, NULL, NULL, NULL };
    void *fmu = FMI(fmi2Instantiate)("r", 1, "@GUID@", "file:re%20sources", &calls, 0, 0);
    double x[2 * N], tau[N];
    char command;
    int i;
    if (!fmu) {
        fprintf(stderr, "%s\n", said);
        return 1;
    }
    while (scanf(" %c", &command) == 1) {
        if (command == 's') {
            if (!numbers(x, 2 * N) || start(fmu, x)) return 1;
        } else if (command == 't') {
            if (!numbers(tau, N) || step(fmu, tau, GAPSCOPE_DT, x)) return 1;
            for (i = 0; i < 2 * N; i++) printf(i ? " %.17g" : "%.17g", x[i]);
            printf("\n");
        } else if (command == 'c') {
            check(fmu, &calls);
        } else {
            return 1;
        }
    }
    FMI(fmi2FreeInstance)(fmu);
    return 0;
}
