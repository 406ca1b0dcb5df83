#ifndef GAPSCOPE_ROBOT_H
#define GAPSCOPE_ROBOT_H

#ifdef __cplusplus
extern "C" {
#endif

#define GAPSCOPE_JOINTS @JOINTS@
/* Length of a step, s. */
#define GAPSCOPE_DT @DT@
#define GAPSCOPE_PAST @PAST@
#define GAPSCOPE_BRISTLES @BRISTLES@
#define GAPSCOPE_DRIVES @DRIVES@
/* C has no array of length 0. */
#define GAPSCOPE_LENGTH(n) ((n) > 0 ? (n) : 1)

/* The robot in a moment. Copying it copies the robot. */
typedef struct {
    double q[GAPSCOPE_JOINTS];                            /* measured positions, rad (m) */
    double v[GAPSCOPE_JOINTS];                            /* measured speeds, rad/s (m/s) */
    double time;                                          /* since the start of the episode, s */
    int filled;                                           /* 1 once the members below are */
    double past[GAPSCOPE_LENGTH(GAPSCOPE_PAST * GAPSCOPE_JOINTS)]; /* efforts logged before, latest first */
    double lagged[GAPSCOPE_JOINTS];                       /* output of the lag, N m (N) */
    double bristles[GAPSCOPE_LENGTH(GAPSCOPE_BRISTLES)];  /* deflections, rad (m) */
    double wind_up[GAPSCOPE_LENGTH(2 * GAPSCOPE_DRIVES)]; /* motor less link and its rate, a drive after the other */
} gapscope_state;

/* A residual network. Set it to { 0 } before the first load. */
typedef struct {
    int layers, on, activation;
    int *sizes;      /* layers + 1 of them */
    double *weights; /* layer after layer, the rows of W and then b */
    double *values[2];
} gapscope_residual;

/* Names of the joints, in the order of all arrays here. */
extern const char *const gapscope_joints[GAPSCOPE_JOINTS];

/* Begins an episode. The first step fills the rest of the state as if its effort had been there before. */
void gapscope_start(gapscope_state *state, const double *q, const double *v);
/* One step of GAPSCOPE_DT under the efforts tau as they are logged or commanded, N m (N), held over the step. */
void gapscope_step(gapscope_state *state, const double *tau);
/* The effort that is wanting: tau less what the motion takes, N m (N), by this sample alone. Joints count as rigid,
   bristles as sliding, drives as warm; delay and lag are left out. A joint that stands bears what its friction can. */
void gapscope_rest(const double *q, const double *v, const double *a, const double *tau, double *rest);
/* The effort that a motion takes, N m (N), by the sample alone; of a joint that stands the least that does. */
void gapscope_inverse_dynamics(const double *q, const double *v, const double *a, double *tau);
/* Accelerations under efforts that act now, rad/s^2 (m/s^2), by the sample alone. */
void gapscope_forward_dynamics(const double *q, const double *v, const double *tau, double *a);

/* Reads the weights that `gapscope export` wrote. 0: done; 1: the file cannot be read; 2: it holds something else, or
   a network for another robot or step; 3: no memory. */
int gapscope_residual_load(gapscope_residual *residual, const char *file);
void gapscope_residual_free(gapscope_residual *residual);
/* One step of f_hyb = f_phys + r_theta. */
void gapscope_hybrid_step(gapscope_state *state, const gapscope_residual *residual, const double *tau);

#ifdef __cplusplus
}
#endif
#endif

#ifndef GAPSCOPE_HEADER_ONLY

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define N GAPSCOPE_JOINTS
/* Links, then the motors that turn on their own. */
#define ALL (N + @MOTORS@)
#define DIRECTIONS @DIRECTIONS@
#define RIPPLES @RIPPLES@
#define DRY DIRECTIONS
#define BENT (DRY + GAPSCOPE_BRISTLES)
#define ROWS (BENT + GAPSCOPE_DRIVES)

/* Vectors are in the link's frame, matrices row by row; a rotation maps to the parent. */
typedef struct {
    int parent, prismatic;
    double rotation[9], translation[3], axis[3], mass, first_moment[3], inertia[9], armature;
} body;
/* s = weight[0] v[joint[0]] + weight[1] v[joint[1]] and what acts along it. */
typedef struct {
    int parts, joint[2];
    double weight[2], viscous, inertia, coulomb, static_rise, stribeck_velocity, cold_rise, time_constant, load;
} direction;
typedef struct { int joint; double coulomb, stiffness; } bristle;
typedef struct { int joint; double amplitude, cycles, phase; } ripple;
/* motor: its coordinate, or -1 without a rotor. */
typedef struct { int joint, motor; double rotor, stiffness, damping, half_gap; } drive;

