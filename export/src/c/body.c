
/* Rigid bodies: recursive Newton-Euler in the links' frames. */

static void turn(const double *r, const double *x, double *y)
{
    int i;
    for (i = 0; i < 3; i++) y[i] = r[3 * i] * x[0] + r[3 * i + 1] * x[1] + r[3 * i + 2] * x[2];
}

static void turn_back(const double *r, const double *x, double *y)
{
    int i;
    for (i = 0; i < 3; i++) y[i] = r[i] * x[0] + r[3 + i] * x[1] + r[6 + i] * x[2];
}

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Rotation about an axis by Rodrigues' formula, after the joint's own. */
static void place(const body *b, double q, double *rotation, double *translation)
{
    double about[9], s = sin(q), c = 1.0 - cos(q);
    const double *u = b->axis;
    int i, j, k;
    for (i = 0; i < 3; i++) translation[i] = b->translation[i];
    if (b->prismatic) {
        double along[3];
        turn(b->rotation, u, along);
        for (i = 0; i < 9; i++) rotation[i] = b->rotation[i];
        for (i = 0; i < 3; i++) translation[i] += q * along[i];
        return;
    }
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) about[3 * i + j] = c * u[i] * u[j] + (i == j ? 1.0 - c : 0.0);
    about[1] -= s * u[2];
    about[2] += s * u[1];
    about[3] += s * u[2];
    about[5] -= s * u[0];
    about[6] -= s * u[1];
    about[7] += s * u[0];
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) {
            rotation[3 * i + j] = 0.0;
            for (k = 0; k < 3; k++) rotation[3 * i + j] += b->rotation[3 * i + k] * about[3 * k + j];
        }
}

/* tau = M a + C v + g, gravity counted `weight` times; positions are true ones. */
static void rigid(const double *q, const double *v, const double *a, double weight, double *tau)
{
    double rotation[N][9], translation[N][3], omega[N][3], alpha[N][3], linear[N][3], force[N][3], moment[N][3];
    const double still[3] = { 0.0, 0.0, 0.0 };
    double lifted[3];
    int i, k;
    for (k = 0; k < 3; k++) lifted[k] = -weight * gravity[k];
    for (i = 0; i < N; i++) {
        const body *b = &bodies[i];
        const double *w = b->parent < 0 ? still : omega[b->parent];
        const double *dw = b->parent < 0 ? still : alpha[b->parent];
        const double *above = b->parent < 0 ? lifted : linear[b->parent];
        double t[3], u[3], x[3], rate[3];
        place(b, q[i], rotation[i], translation[i]);
        cross(w, translation[i], t);
        cross(w, t, u);
        cross(dw, translation[i], t);
        for (k = 0; k < 3; k++) x[k] = above[k] + t[k] + u[k];
        turn_back(rotation[i], x, linear[i]);
        turn_back(rotation[i], w, omega[i]);
        turn_back(rotation[i], dw, alpha[i]);
        for (k = 0; k < 3; k++) rate[k] = b->axis[k] * v[i];
        cross(omega[i], rate, t);
        for (k = 0; k < 3; k++) {
            if (b->prismatic) {
                linear[i][k] += b->axis[k] * a[i] + 2.0 * t[k];
            } else {
                omega[i][k] += rate[k];
                alpha[i][k] += b->axis[k] * a[i] + t[k];
            }
        }
        /* Force and moment about the link's origin. */
        cross(omega[i], b->first_moment, t);
        cross(omega[i], t, u);
        cross(alpha[i], b->first_moment, t);
        for (k = 0; k < 3; k++) force[i][k] = b->mass * linear[i][k] + t[k] + u[k];
        turn(b->inertia, omega[i], t);
        cross(omega[i], t, u);
        turn(b->inertia, alpha[i], t);
        cross(b->first_moment, linear[i], x);
        for (k = 0; k < 3; k++) moment[i][k] = t[k] + u[k] + x[k];
    }
    for (i = N - 1; i >= 0; i--) {
        const body *b = &bodies[i];
        tau[i] = dot(b->axis, b->prismatic ? force[i] : moment[i]) + b->armature * a[i];
        if (b->parent >= 0) {
            double f[3], m[3], t[3];
            turn(rotation[i], force[i], f);
            turn(rotation[i], moment[i], m);
            cross(translation[i], f, t);
            for (k = 0; k < 3; k++) {
                force[b->parent][k] += f[k];
                moment[b->parent][k] += m[k] + t[k];
            }
        }
    }
}

static void mass_matrix(const double *q, double m[N][N])
{
    double still[N], unit[N], column[N];
    int i, j;
    for (i = 0; i < N; i++) still[i] = unit[i] = 0.0;
    for (j = 0; j < N; j++) {
        unit[j] = 1.0;
        rigid(q, still, unit, 0.0, column);
        unit[j] = 0.0;
        for (i = 0; i < N; i++) m[i][j] = column[i];
    }
}

/* Inverse of a symmetric positive definite matrix by Cholesky; m is destroyed. */
static void invert(double m[ALL][ALL], double inverse[ALL][ALL])
{
    int i, j, k;
    for (j = 0; j < ALL; j++) {
        for (k = 0; k < j; k++) {
            double factor = m[j][k];
            for (i = j; i < ALL; i++) m[i][j] -= m[i][k] * factor;
        }
        /* A massless link accelerates very fast here, and not without bound. */
        m[j][j] = sqrt(fmax(m[j][j], 1e-12));
        for (i = j + 1; i < ALL; i++) m[i][j] /= m[j][j];
    }
    for (i = 0; i < ALL; i++)
        for (j = 0; j < ALL; j++) inverse[i][j] = 0.0;
    for (j = 0; j < ALL; j++) {
        inverse[j][j] = 1.0 / m[j][j];
        for (i = j + 1; i < ALL; i++) {
            double sum = 0.0;
            for (k = j; k < i; k++) sum += m[i][k] * inverse[j][k];
            inverse[j][i] = -sum / m[i][i];
        }
    }
    for (i = 0; i < ALL; i++)
        for (j = i; j < ALL; j++) {
            double sum = 0.0;
            for (k = j; k < ALL; k++) sum += inverse[i][k] * inverse[j][k];
            m[i][j] = sum;
        }
    for (i = 0; i < ALL; i++)
        for (j = i; j < ALL; j++) inverse[i][j] = inverse[j][i] = m[i][j];
}
