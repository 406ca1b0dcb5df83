/* The corrected model of a robot as a Simulink S-function. All physics is in robot.c.

   Build in MATLAB with: mex robot_sfun.c robot.c
   Parameters: positions and speeds at the start, rad and rad/s (m and m/s), a number for each joint.
   Input: efforts, N m (N), held over a step of GAPSCOPE_DT. Outputs: measured positions; measured speeds. */

#define S_FUNCTION_NAME robot_sfun
#define S_FUNCTION_LEVEL 2
#include "simstruc.h"
#define GAPSCOPE_HEADER_ONLY
#include "robot.c"
#include <string.h>

static gapscope_state get(SimStruct *S)
{
    gapscope_state state;
    memcpy(&state, ssGetDWork(S, 0), sizeof state);
    return state;
}

static void put(SimStruct *S, const gapscope_state *state) { memcpy(ssGetDWork(S, 0), state, sizeof *state); }

static void mdlInitializeSizes(SimStruct *S)
{
    int i;
    ssSetNumSFcnParams(S, 2);
    if (ssGetSFcnParamsCount(S) != 2) return;
    for (i = 0; i < 2; i++) {
        const mxArray *start = ssGetSFcnParam(S, i);
        ssSetSFcnParamTunable(S, i, 0);
        if (!mxIsDouble(start) || mxGetNumberOfElements(start) != GAPSCOPE_JOINTS) {
            ssSetErrorStatus(S, "The parameters are positions and speeds at the start: give a number for each joint.");
            return;
        }
    }
    ssSetNumContStates(S, 0);
    ssSetNumDiscStates(S, 0);
    if (!ssSetNumInputPorts(S, 1) || !ssSetNumOutputPorts(S, 2)) return;
    ssSetInputPortWidth(S, 0, GAPSCOPE_JOINTS);
    ssSetInputPortRequiredContiguous(S, 0, 1);
    ssSetInputPortDirectFeedThrough(S, 0, 0);
    ssSetOutputPortWidth(S, 0, GAPSCOPE_JOINTS);
    ssSetOutputPortWidth(S, 1, GAPSCOPE_JOINTS);
    ssSetNumSampleTimes(S, 1);
    /* Where Simulink saves and restores it with the rest of the model. */
    ssSetNumDWork(S, 1);
    ssSetDWorkWidth(S, 0, (int)sizeof(gapscope_state));
    ssSetDWorkDataType(S, 0, SS_UINT8);
}

static void mdlInitializeSampleTimes(SimStruct *S)
{
    ssSetSampleTime(S, 0, GAPSCOPE_DT);
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S)
{
    gapscope_state state;
    gapscope_start(&state, mxGetPr(ssGetSFcnParam(S, 0)), mxGetPr(ssGetSFcnParam(S, 1)));
    put(S, &state);
}

static void mdlOutputs(SimStruct *S, int_T task)
{
    const gapscope_state state = get(S);
    (void)task;
    memcpy(ssGetOutputPortRealSignal(S, 0), state.q, sizeof state.q);
    memcpy(ssGetOutputPortRealSignal(S, 1), state.v, sizeof state.v);
}

#define MDL_UPDATE
static void mdlUpdate(SimStruct *S, int_T task)
{
    gapscope_state state = get(S);
    (void)task;
    gapscope_step(&state, (const double *)ssGetInputPortSignal(S, 0));
    put(S, &state);
}

static void mdlTerminate(SimStruct *S) { (void)S; }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
