/* Stands where Simulink's glue does: drives the S-function in the order in which Simulink calls it. */
#include <stdio.h>

static int numbers(double *x)
{
    int j;
    for (j = 0; j < GAPSCOPE_JOINTS; j++)
        if (scanf("%lf", &x[j]) != 1) return 0;
    return 1;
}

int main(void)
{
    static SimStruct S;
    char command;
    int i, j;
    S.parameters[0].count = GAPSCOPE_JOINTS;
    S.parameters[1].count = GAPSCOPE_JOINTS - 1;
    mdlInitializeSizes(&S);
    if (!S.error) return 1;
    S.error = NULL;
    S.parameters[1].count = GAPSCOPE_JOINTS;
    mdlInitializeSizes(&S);
    mdlInitializeSampleTimes(&S);
    if (S.error || S.input_width != GAPSCOPE_JOINTS || S.output_width[1] != GAPSCOPE_JOINTS || S.through) return 1;
    if (S.sample_time != GAPSCOPE_DT || !S.contiguous || S.inputs != 1 || S.outputs != 2) return 1;
    if ((size_t)S.memory_width > sizeof S.memory) return 1;
    while (scanf(" %c", &command) == 1) {
        if (command == 's') {
            if (!numbers(S.parameters[0].values) || !numbers(S.parameters[1].values)) return 1;
            mdlInitializeConditions(&S);
            mdlOutputs(&S, 0);
            for (j = 0; j < GAPSCOPE_JOINTS; j++)
                if (S.output[0][j] != S.parameters[0].values[j]) return 1;
        } else if (command == 't') {
            if (!numbers(S.input)) return 1;
            mdlUpdate(&S, 0);
            mdlOutputs(&S, 0);
            for (i = 0; i < 2; i++)
                for (j = 0; j < GAPSCOPE_JOINTS; j++) printf(i + j ? " %.17g" : "%.17g", S.output[i][j]);
            printf("\n");
        } else {
            return 1;
        }
    }
    mdlTerminate(&S);
    return 0;
}
