
/* Effects. What each line means is in gapscope's documentation of `Plant`. */

static double clamp(double x, double most) { return fmin(fmax(x, -most), most); }

/* Gain, bias and saturation. */
static double at_joint(int j, double effort) { return clamp(gain[j] * effort + bias[j], limit[j]); }

static double along(const direction *d, const double *x)
{
    return d->weight[0] * x[d->joint[0]] + d->weight[1] * x[d->joint[1]];
}

/* Greatest dry friction, N m (N); delivered may be NULL for that without load. */
static double bound(const direction *d, double speed, double time, const double *delivered)
{
    double most = d->coulomb;
    if (d->static_rise > 0.0) most += d->static_rise * exp(-pow(speed / d->stribeck_velocity, 2.0));
    if (d->cold_rise != 0.0) most += d->cold_rise * exp(-time / d->time_constant);
    if (d->load > 0.0 && delivered) most += d->load * fabs(delivered[d->joint[0]]);
    return most;
}

/* Force of a bristle that has bent by z, of a step h that ends at the speed free - mobility h force. */
static double bristle_force(const bristle *b, double h, double free_speed, double mobility, double z)
{
    double mu = mobility * h * b->stiffness, rest = free_speed - mu * z;
    double u = copysign(1.0, rest) * free_speed, c = fabs(rest), a = h * b->stiffness / b->coulomb;
    double k = 1.0 + mu * h - a * u, root = sqrt(k * k + 4.0 * a * c);
    double size = k >= 0.0 ? 2.0 * c / (k + root) : (root - k) / (2.0 * a);
    return clamp(b->stiffness * (z + h * copysign(1.0, rest) * size) / (1.0 + a * size), b->coulomb);
}

static double across(const drive *d, const double *x) { return d->motor < 0 ? 0.0 : x[d->motor] - x[d->joint]; }

static double wound(const drive *d, double torque)
{
    return torque / d->stiffness + (torque == 0.0 ? 0.0 : copysign(d->half_gap, torque));
}

static double contact_side(const drive *d, double k, double damping, double h, double x, double rates, double mobility)
{
    double open = k * (x - d->half_gap + 0.25 * h * rates) + 0.5 * damping * rates;
    return h * open / (1.0 + h * mobility * (0.25 * h * k + 0.5 * damping));
}

/* Impulse from motor to link over h in play; contact never pulls. */
static double contact(const drive *d, double h, double x, double rates, double mobility)
{
    double side[2];
    int i;
    for (i = 0; i < 2; i++) {
        double s = i ? -1.0 : 1.0;
        double damped = contact_side(d, d->stiffness, d->damping, h, s * x, s * rates, mobility);
        double most = contact_side(d, 2.0 * d->stiffness, 0.0, h, s * x, s * rates, mobility);
        side[i] = fmax(fmin(damped, most), 0.0);
    }
    return side[0] - side[1];
}

/* Mean efforts delivered over a step of the efforts tau; moves delay and lag on. */
static void deliver(gapscope_state *state, const double *tau, double *delivered)
{
    int i, j;
    if (!state->filled) {
        for (i = 0; i < GAPSCOPE_PAST; i++)
            for (j = 0; j < N; j++) state->past[i * N + j] = tau[j];
        for (j = 0; j < N; j++) state->lagged[j] = tau[j];
    }
    for (j = 0; j < N; j++) {
        double late = delay_steps > 0 ? state->past[(delay_steps - 1) * N + j] : tau[j];
        double early = delay_fraction > 0.0 ? state->past[delay_steps * N + j] : late;
        double mean = late + delay_fraction * (early - late);
        if (lag > 0.0) {
            const double effort[2] = { early, late }, part[2] = { delay_fraction, 1.0 - delay_fraction };
            mean = 0.0;
            for (i = 0; i < 2; i++) {
                double settled = -expm1(-part[i] * GAPSCOPE_DT / lag);
                mean += effort[i] * part[i] + (state->lagged[j] - effort[i]) * settled * lag / GAPSCOPE_DT;
                state->lagged[j] += (effort[i] - state->lagged[j]) * settled;
            }
        }
        delivered[j] = at_joint(j, mean);
    }
    for (i = GAPSCOPE_PAST - 1; i > 0; i--)
        for (j = 0; j < N; j++) state->past[i * N + j] = state->past[(i - 1) * N + j];
    if (GAPSCOPE_PAST > 0)
        for (j = 0; j < N; j++) state->past[j] = tau[j];
}

/* A part of a step: it begins at (q_start, v_start), its dynamics are those at (q, v). */
typedef struct {
    double delivered[N], q_start[ALL], v_start[ALL], q[ALL], v[ALL], v_end[ALL];
    double impulse[GAPSCOPE_LENGTH(ROWS)], most[GAPSCOPE_LENGTH(ROWS)];
} stage;

static void parts(int row, int *joint, double *weight)
{
    if (row < DRY) {
        joint[0] = directions[row].joint[0];
        joint[1] = directions[row].joint[1];
        weight[0] = directions[row].weight[0];
        weight[1] = directions[row].weight[1];
    } else if (row < BENT) {
        joint[0] = joint[1] = bristles[row - DRY].joint;
        weight[0] = 1.0;
        weight[1] = 0.0;
    } else {
        const drive *d = &drives[row - BENT];
        joint[0] = d->motor < 0 ? d->joint : d->motor;
        joint[1] = d->joint;
        weight[0] = 1.0;
        weight[1] = -1.0;
    }
}

/* Impulses of dry friction, bristles and play by projected Gauss-Seidel. */
static void solve(stage *s, double inverse[ALL][ALL], double h, double time, const double *bent, int locked)
{
    int row, i, k, sweep;
    for (row = 0; row < ROWS; row++) {
        s->impulse[row] = s->most[row] = 0.0;
        if (row < DRY) s->most[row] = h * bound(&directions[row], along(&directions[row], s->v), time, s->delivered);
        else if (row < BENT) s->most[row] = h * bristles[row - DRY].coulomb;
        else if (!locked && drives[row - BENT].motor >= 0 && drives[row - BENT].half_gap > 0.0) s->most[row] = DBL_MIN;
    }
    for (sweep = 0; sweep < 60; sweep++) {
        int settled = 1;
        for (row = 0; row < ROWS; row++) {
            int joint[2];
            double weight[2], mobility = 0.0, speed, unbraked, wanted, change;
            parts(row, joint, weight);
            for (i = 0; i < 2; i++)
                for (k = 0; k < 2; k++) mobility += weight[i] * inverse[joint[i]][joint[k]] * weight[k];
            if (!(s->most[row] > 0.0 && mobility > 0.0)) continue;
            speed = weight[0] * s->v_end[joint[0]] + weight[1] * s->v_end[joint[1]];
            unbraked = speed + mobility * s->impulse[row];
            if (row < DRY) {
                wanted = clamp(s->impulse[row] + speed / mobility, s->most[row]);
            } else if (row < BENT) {
                wanted = h * bristle_force(&bristles[row - DRY], h, unbraked, mobility, bent[row - DRY]);
            } else {
                const drive *d = &drives[row - BENT];
                wanted = contact(d, h, across(d, s->q_start), across(d, s->v_start) + unbraked, mobility);
            }
            change = wanted - s->impulse[row];
            if (change == 0.0) continue;
            s->impulse[row] = wanted;
            for (i = 0; i < 2; i++)
                for (k = 0; k < ALL; k++) s->v_end[k] -= inverse[k][joint[i]] * weight[i] * change;
            if (!(fabs(change) <= 1e-10 * fmax(s->most[row], fabs(wanted)))) settled = 0;
        }
        if (settled) break;
    }
    /* A joint whose friction is not used up stands still. */
    for (row = 0; row < DRY; row++)
        if (directions[row].parts == 1 && fabs(s->impulse[row]) < s->most[row]) s->v_end[directions[row].joint[0]] = 0.0;
}

static void add_along(double m[ALL][ALL], const int *joint, const double *weight, double value)
{
    int i, k;
    for (i = 0; i < 2; i++)
        for (k = 0; k < 2; k++) m[joint[i]][joint[k]] += weight[i] * weight[k] * value;
}

/* Speeds at the end of a time h. Locked drives turn with their link. */
static void take(stage *s, double h, double time, const double *bent, int locked)
{
    double links[N][N], mass[ALL][ALL], inverse[ALL][ALL], force[ALL], still[N];
    int i, j;
    for (i = 0; i < ALL; i++)
        for (j = 0; j < ALL; j++) mass[i][j] = 0.0;
    for (j = 0; j < N; j++) still[j] = 0.0;
    mass_matrix(s->q, links);
    rigid(s->q, s->v, still, 1.0, force);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++) mass[i][j] = links[i][j];
    for (j = 0; j < N; j++) {
        double pull = stiffness[j] * (s->q_start[j] + 0.5 * h * s->v_start[j]) - spring_torque[j];
        force[j] = h * (s->delivered[j] - force[j] - pull);
        mass[j][j] += 0.25 * h * h * stiffness[j];
    }
    for (i = 0; i < RIPPLES; i++) {
        const ripple *r = &ripples[i];
        force[r->joint] += h * r->amplitude * sin(r->cycles * s->q[r->joint] + r->phase);
    }
    for (i = 0; i < GAPSCOPE_DRIVES; i++) {
        const drive *d = &drives[i];
        const double weight[2] = { 1.0, -1.0 };
        double pull = 0.0, stiff;
        int joint[2];
        if (d->motor < 0) continue;
        joint[0] = d->motor;
        joint[1] = d->joint;
        /* The effort drives the motor; the spring takes it to the link. */
        force[d->motor] = h * s->delivered[d->joint];
        force[d->joint] -= h * s->delivered[d->joint];
        mass[d->motor][d->motor] = d->rotor;
        if (locked) {
            stiff = 1e5 * (d->rotor + links[d->joint][d->joint]);
        } else if (d->half_gap == 0.0) {
            double rate = across(d, s->v_start), middle = across(d, s->q_start) + 0.5 * h * rate;
            pull = h * (d->stiffness * middle + d->damping * rate);
            stiff = 0.5 * h * d->damping + 0.25 * h * h * d->stiffness;
        } else {
            continue;
        }
        force[d->motor] -= pull;
        force[d->joint] += pull;
        add_along(mass, joint, weight, stiff);
    }
    for (i = 0; i < DIRECTIONS; i++) {
        const direction *d = &directions[i];
        double drag = h * d->viscous * along(d, s->v_start);
        force[d->joint[0]] -= d->weight[0] * drag;
        force[d->joint[1]] -= d->weight[1] * drag;
        add_along(mass, d->joint, d->weight, d->inertia + 0.5 * h * d->viscous);
    }
    invert(mass, inverse);
    for (i = 0; i < ALL; i++) {
        double change = 0.0;
        for (j = 0; j < ALL; j++) change += inverse[i][j] * force[j];
        s->v_end[i] = s->v_start[i] + change;
    }
    solve(s, inverse, h, time, bent, locked);
}

/* Coordinates where the step begins, from the measured state. */
static void gather(stage *s, const gapscope_state *state)
{
    int i, j;
    for (j = 0; j < N; j++) {
        s->q_start[j] = state->q[j] - offset[j];
        s->v_start[j] = state->v[j];
    }
    for (i = 0; i < GAPSCOPE_DRIVES; i++) {
        const drive *d = &drives[i];
        if (motor_encoders) {
            s->q_start[d->joint] -= state->wind_up[2 * i];
            s->v_start[d->joint] -= state->wind_up[2 * i + 1];
        }
        if (d->motor >= 0) {
            s->q_start[d->motor] = s->q_start[d->joint] + state->wind_up[2 * i];
            s->v_start[d->motor] = s->v_start[d->joint] + state->wind_up[2 * i + 1];
        }
    }
}

/* Wind-up of the drives had their motors turned with the links until now. */
static void wind(stage *s, gapscope_state *state)
{
    int i, j;
    for (i = 0; i < 2 * GAPSCOPE_DRIVES; i++) state->wind_up[i] = 0.0;
    gather(s, state);
    for (j = 0; j < ALL; j++) {
        s->q[j] = s->q_start[j];
        s->v[j] = s->v_start[j];
    }
    take(s, GAPSCOPE_DT, state->time, state->bristles, 1);
    for (i = 0; i < GAPSCOPE_DRIVES; i++) {
        const drive *d = &drives[i];
        double inertial = d->motor < 0 ? 0.0 : d->rotor * (s->v_end[d->motor] - s->v_start[d->motor]) / GAPSCOPE_DT;
        state->wind_up[2 * i] = wound(d, s->delivered[d->joint] - inertial);
    }
}

void gapscope_start(gapscope_state *state, const double *q, const double *v)
{
    memset(state, 0, sizeof *state);
    memcpy(state->q, q, sizeof state->q);
    memcpy(state->v, v, sizeof state->v);
}

void gapscope_step(gapscope_state *state, const double *tau)
{
    const double h = GAPSCOPE_DT / substeps;
    stage s;
    int i, j, part;
    deliver(state, tau, s.delivered);
    if (GAPSCOPE_DRIVES > 0 && !state->filled) wind(&s, state);
    gather(&s, state);
    for (part = 0; part < substeps; part++) {
        for (j = 0; j < ALL; j++) {
            if (part > 0) {
                s.q_start[j] += 0.5 * h * (s.v_start[j] + s.v_end[j]);
                s.v_start[j] = s.v_end[j];
            }
            s.q[j] = s.q_start[j];
            s.v[j] = s.v_start[j];
        }
        /* Predict the midpoint, then take the whole step with the dynamics found there. */
        take(&s, 0.5 * h, state->time, state->bristles, 0);
        for (j = 0; j < ALL; j++) {
            s.v[j] = s.v_end[j];
            s.q[j] = s.q_start[j] + 0.25 * h * (s.v_start[j] + s.v_end[j]);
        }
        take(&s, h, state->time, state->bristles, 0);
        for (i = 0; i < GAPSCOPE_BRISTLES; i++) state->bristles[i] = s.impulse[DRY + i] / (h * bristles[i].stiffness);
    }
    for (j = 0; j < ALL; j++) s.q[j] = s.q_start[j] + 0.5 * h * (s.v_start[j] + s.v_end[j]);
    for (j = 0; j < N; j++) {
        state->q[j] = s.q[j] + offset[j];
        state->v[j] = s.v_end[j];
    }
    for (i = 0; i < GAPSCOPE_DRIVES; i++) {
        const drive *d = &drives[i];
        double *w = &state->wind_up[2 * i];
        if (d->motor >= 0) {
            w[0] = across(d, s.q);
            w[1] = across(d, s.v_end);
        } else {
            double before = w[0];
            w[0] = wound(d, s.delivered[d->joint]);
            w[1] = (w[0] - before) / GAPSCOPE_DT;
        }
        if (motor_encoders) {
            state->q[d->joint] += w[0];
            state->v[d->joint] += w[1];
        }
    }
    state->time += GAPSCOPE_DT;
    state->filled = 1;
}
