/* What the S-function calls of Simulink's simstruc.h, enough to drive it without MATLAB. */
#include <stddef.h>

typedef int int_T;
typedef double real_T;
typedef struct { double values[64]; size_t count; } mxArray;
typedef struct {
    mxArray parameters[2];
    int parameter_count, inputs, outputs, input_width, output_width[2], through, contiguous;
    double sample_time, input[64], output[2][64];
    int memory_width;
    unsigned char memory[65536];
    const char *error;
} SimStruct;
#define SS_UINT8 3

#define ssSetNumSFcnParams(S, n) ((S)->parameter_count = (n))
#define ssGetSFcnParamsCount(S) ((S)->parameter_count)
#define ssGetSFcnParam(S, i) (&(S)->parameters[i])
#define ssSetSFcnParamTunable(S, i, is) ((void)(i), (void)(is))
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define ssSetNumContStates(S, n) ((void)(n))
#define ssSetNumDiscStates(S, n) ((void)(n))
#define ssSetNumInputPorts(S, n) ((S)->inputs = (n))
#define ssSetNumOutputPorts(S, n) ((S)->outputs = (n))
#define ssSetInputPortWidth(S, i, n) ((S)->input_width = (n))
#define ssSetInputPortRequiredContiguous(S, i, is) ((S)->contiguous = (is))
#define ssSetInputPortDirectFeedThrough(S, i, is) ((S)->through = (is))
#define ssSetOutputPortWidth(S, i, n) ((S)->output_width[i] = (n))
#define ssSetNumSampleTimes(S, n) ((void)(n))
#define ssSetSampleTime(S, i, time) ((S)->sample_time = (time))
#define ssSetOffsetTime(S, i, time) ((void)(time))
#define ssSetNumDWork(S, n) ((void)(n))
#define ssSetDWorkWidth(S, i, n) ((S)->memory_width = (n))
#define ssSetDWorkDataType(S, i, type) ((void)(type))
#define ssGetDWork(S, i) ((void *)(S)->memory)
#define ssGetInputPortSignal(S, i) ((const void *)(S)->input)
#define ssGetOutputPortRealSignal(S, i) ((S)->output[i])
#define mxIsDouble(array) ((array)->count > 0)
#define mxGetNumberOfElements(array) ((array)->count)
#define mxGetPr(array) ((array)->values)
