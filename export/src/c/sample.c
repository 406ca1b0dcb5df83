
/* One sample by itself. */

static double band(const direction *d)
{
    return fabs(d->weight[0]) * standstill[d->joint[0]] + fabs(d->weight[1]) * standstill[d->joint[1]];
}

/* Whether a coupling of joints that stands holds some torque of joint j. */
static int held(int j, const double *v)
{
    int i;
    for (i = 0; i < DIRECTIONS; i++) {
        const direction *d = &directions[i];
        if (d->parts > 1 && (d->joint[0] == j || d->joint[1] == j) && fabs(along(d, v)) < band(d)) return 1;
    }
    return 0;
}

static double sliding(double most, double speed, double standing, double hold)
{
    return fabs(speed) >= standing ? copysign(most, speed) : clamp(hold, fmax(most, 0.0));
}

/* What all but dry friction leaves of the delivered efforts; not yet over the gain. */
static void smooth(const double *q, const double *v, const double *a, const double *delivered, double *rest)
{
    double at[N];
    int i, j;
    for (j = 0; j < N; j++) at[j] = q[j] - offset[j];
    rigid(at, v, a, 1.0, rest);
    for (j = 0; j < N; j++) rest[j] = delivered[j] + spring_torque[j] - rest[j] - stiffness[j] * at[j];
    for (i = 0; i < RIPPLES; i++)
        rest[ripples[i].joint] += ripples[i].amplitude * sin(ripples[i].cycles * at[ripples[i].joint] + ripples[i].phase);
    for (i = 0; i < GAPSCOPE_DRIVES; i++) rest[drives[i].joint] -= drives[i].rotor * a[drives[i].joint];
    for (i = 0; i < DIRECTIONS; i++) {
        const direction *d = &directions[i];
        double force = d->viscous * along(d, v) + d->inertia * along(d, a);
        rest[d->joint[0]] -= d->weight[0] * force;
        rest[d->joint[1]] -= d->weight[1] * force;
    }
}

/* What stands holds what all that slides leaves: the forces, each up to its bound, that leave least. A coupling and the frictions
   of its two joints share what they hold. */
static void hold(const double *v, const double *delivered, double *rest)
{
    double force[GAPSCOPE_LENGTH(DIRECTIONS)];
    int i, sweep;
    for (i = 0; i < DIRECTIONS; i++) force[i] = 0.0;
    for (sweep = 0; sweep < 60; sweep++) {
        double change = 0.0, largest = 0.0;
        for (i = 0; i < DIRECTIONS; i++) {
            const direction *d = &directions[i];
            double speed = along(d, v), square = d->weight[0] * d->weight[0] + d->weight[1] * d->weight[1], next;
            if (fabs(speed) >= band(d)) continue;
            next = clamp(force[i] + along(d, rest) / square, fmax(bound(d, speed, HUGE_VAL, delivered), 0.0));
            rest[d->joint[0]] -= d->weight[0] * (next - force[i]);
            rest[d->joint[1]] -= d->weight[1] * (next - force[i]);
            change = fmax(change, fabs(next - force[i]));
            largest = fmax(largest, fabs(next));
            force[i] = next;
        }
        if (change <= 1e-10 * largest) break;
    }
}

void gapscope_rest(const double *q, const double *v, const double *a, const double *tau, double *rest)
{
    double delivered[N];
    int i, j;
    for (j = 0; j < N; j++) delivered[j] = at_joint(j, tau[j]);
    smooth(q, v, a, delivered, rest);
    for (i = 0; i < GAPSCOPE_BRISTLES; i++) {
        j = bristles[i].joint;
        rest[j] -= sliding(bristles[i].coulomb, v[j], standstill[j], rest[j]);
    }
    for (i = 0; i < DIRECTIONS; i++) {
        const direction *d = &directions[i];
        double speed = along(d, v), force;
        int loaded = d->load > 0.0 && held(d->joint[0], v);
        if (fabs(speed) < band(d)) continue;
        force = copysign(bound(d, speed, HUGE_VAL, loaded ? delivered : NULL), speed);
        rest[d->joint[0]] -= d->weight[0] * force;
        rest[d->joint[1]] -= d->weight[1] * force;
    }
    hold(v, delivered, rest);
    /* Friction under load goes by the effort that the motion takes, not by the one that is given. */
    for (i = 0; i < DIRECTIONS; i++) {
        const direction *d = &directions[i];
        j = d->joint[0];
        if (d->load > 0.0 && d->parts == 1 && fabs(v[j]) >= standstill[j] && !held(j, v)) {
            double needed = delivered[j] - rest[j];
            rest[j] = delivered[j] - needed / (1.0 - copysign(d->load, v[j]) * copysign(1.0, needed));
        }
    }
    for (j = 0; j < N; j++) rest[j] /= gain[j];
}

void gapscope_inverse_dynamics(const double *q, const double *v, const double *a, double *tau)
{
    double none[N];
    int j;
    for (j = 0; j < N; j++) none[j] = 0.0;
    gapscope_rest(q, v, a, none, tau);
    for (j = 0; j < N; j++) tau[j] = -tau[j];
}

void gapscope_forward_dynamics(const double *q, const double *v, const double *tau, double *a)
{
    double delivered[N], force[N], at[N], links[N][N], mass[ALL][ALL], inverse[ALL][ALL];
    double impulse[GAPSCOPE_LENGTH(BENT)], most[GAPSCOPE_LENGTH(BENT)];
    int i, j, k, row, sweep;
    for (j = 0; j < N; j++) {
        delivered[j] = at_joint(j, tau[j]);
        at[j] = q[j] - offset[j];
        a[j] = 0.0;
    }
    smooth(q, v, a, delivered, force);
    for (i = 0; i < ALL; i++)
        for (j = 0; j < ALL; j++) mass[i][j] = i == j ? 1.0 : 0.0;
    mass_matrix(at, links);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++) mass[i][j] = links[i][j];
    for (i = 0; i < GAPSCOPE_DRIVES; i++) mass[drives[i].joint][drives[i].joint] += drives[i].rotor;
    for (i = 0; i < DIRECTIONS; i++) add_along(mass, directions[i].joint, directions[i].weight, directions[i].inertia);
    /* What slides is a force; what stands holds. */
    for (row = 0; row < BENT; row++) {
        int joint[2];
        double weight[2], speed, standing;
        parts(row, joint, weight);
        speed = weight[0] * v[joint[0]] + weight[1] * v[joint[1]];
        standing = row < DRY ? band(&directions[row]) : standstill[joint[0]];
        most[row] = row < DRY ? bound(&directions[row], speed, HUGE_VAL, delivered) : bristles[row - DRY].coulomb;
        impulse[row] = 0.0;
        if (fabs(speed) >= standing) {
            for (i = 0; i < 2; i++) force[joint[i]] -= weight[i] * copysign(most[row], speed);
            most[row] = 0.0;
        }
    }
    invert(mass, inverse);
    for (j = 0; j < N; j++)
        for (k = 0; k < N; k++) a[j] += inverse[j][k] * force[k];
    for (sweep = 0; sweep < 1000; sweep++) {
        int settled = 1;
        for (row = 0; row < BENT; row++) {
            int joint[2];
            double weight[2], mobility = 0.0, wanted, change;
            parts(row, joint, weight);
            for (i = 0; i < 2; i++)
                for (k = 0; k < 2; k++) mobility += weight[i] * inverse[joint[i]][joint[k]] * weight[k];
            if (!(most[row] > 0.0 && mobility > 0.0)) continue;
            wanted = impulse[row] + (weight[0] * a[joint[0]] + weight[1] * a[joint[1]]) / mobility;
            wanted = clamp(wanted, most[row]);
            change = wanted - impulse[row];
            impulse[row] = wanted;
            for (i = 0; i < 2; i++)
                for (k = 0; k < N; k++) a[k] -= inverse[k][joint[i]] * weight[i] * change;
            if (!(fabs(change) <= 1e-14 * most[row])) settled = 0;
        }
        if (settled) break;
    }
}
