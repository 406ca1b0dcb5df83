
/* The residual network. File: "GSRESID1"; then little-endian: joints, what it corrects (0 next state, 1 acceleration,
   2 torque), activation (0 tanh, 1 relu, 2 sigmoid, 3 none), number of layers L, L + 1 sizes, each 32 bits; dt as a
   double; of each layer the rows of W, then b, as floats. */

static int read_bytes(FILE *file, int count, unsigned long long *value)
{
    unsigned char bytes[8];
    int i;
    if (fread(bytes, 1, (size_t)count, file) != (size_t)count) return 0;
    *value = 0;
    for (i = count - 1; i >= 0; i--) *value = *value << 8 | bytes[i];
    return 1;
}

static int read_count(FILE *file, int *value)
{
    unsigned long long bits;
    if (!read_bytes(file, 4, &bits) || bits > 1000000) return 0;
    *value = (int)bits;
    return 1;
}

/* A float by its bits, whatever this machine's are. */
static double as_float(unsigned long long bits)
{
    int exponent = (int)(bits >> 23 & 255);
    double mantissa = (double)(bits & 0x7fffff);
    double size = exponent ? ldexp(mantissa + 0x800000, exponent - 150) : ldexp(mantissa, -149);
    return bits >> 31 ? -size : size;
}

static double as_double(unsigned long long bits)
{
    double mantissa = (double)(bits & 0xfffffffffffffull);
    return ldexp(mantissa + 4503599627370496.0, (int)(bits >> 52 & 2047) - 1075);
}

void gapscope_residual_free(gapscope_residual *residual)
{
    free(residual->sizes);
    free(residual->weights);
    free(residual->values[0]);
    free(residual->values[1]);
    memset(residual, 0, sizeof *residual);
}

static int load(gapscope_residual *r, FILE *file)
{
    char magic[8];
    unsigned long long bits;
    int joints, i, widest = 0;
    size_t count = 0, k;
    if (fread(magic, 1, 8, file) != 8 || memcmp(magic, "GSRESID1", 8) != 0) return 2;
    if (!read_count(file, &joints) || !read_count(file, &r->on) || !read_count(file, &r->activation)) return 2;
    if (joints != N || r->on > 2 || r->activation > 3) return 2;
    if (!read_count(file, &r->layers) || r->layers < 1 || r->layers > 1000) return 2;
    r->sizes = malloc(sizeof *r->sizes * (size_t)(r->layers + 1));
    if (!r->sizes) return 3;
    for (i = 0; i <= r->layers; i++) {
        if (!read_count(file, &r->sizes[i]) || r->sizes[i] < 1) return 2;
        if (r->sizes[i] > widest) widest = r->sizes[i];
        if (i > 0) count += (size_t)r->sizes[i] * ((size_t)r->sizes[i - 1] + 1);
    }
    if (r->sizes[0] != 3 * N || r->sizes[r->layers] != (r->on == 0 ? 2 * N : N)) return 2;
    if (!read_bytes(file, 8, &bits) || fabs(as_double(bits) - GAPSCOPE_DT) > 1e-9 * GAPSCOPE_DT) return 2;
    r->weights = malloc(sizeof *r->weights * count);
    for (i = 0; i < 2; i++) r->values[i] = malloc(sizeof **r->values * (size_t)widest);
    if (!r->weights || !r->values[0] || !r->values[1]) return 3;
    for (k = 0; k < count; k++) {
        if (!read_bytes(file, 4, &bits)) return 2;
        r->weights[k] = as_float(bits);
    }
    return fgetc(file) == EOF ? 0 : 2;
}

int gapscope_residual_load(gapscope_residual *residual, const char *name)
{
    FILE *file = fopen(name, "rb");
    int failed;
    if (!file) return 1;
    gapscope_residual_free(residual);
    failed = load(residual, file);
    fclose(file);
    if (failed) gapscope_residual_free(residual);
    return failed;
}

/* r_theta(q, v, tau); the result lives until the next call. */
static const double *correction(const gapscope_residual *r, const gapscope_state *state, const double *tau)
{
    const double *w = r->weights;
    double *x = r->values[0], *y = r->values[1];
    size_t i, j;
    int layer;
    memcpy(x, state->q, sizeof state->q);
    memcpy(x + N, state->v, sizeof state->v);
    for (j = 0; j < N; j++) x[2 * N + j] = tau[j];
    for (layer = 0; layer < r->layers; layer++) {
        size_t inputs = (size_t)r->sizes[layer], outputs = (size_t)r->sizes[layer + 1];
        double *done = x;
        for (i = 0; i < outputs; i++) {
            double sum = w[inputs * outputs + i];
            for (j = 0; j < inputs; j++) sum += w[i * inputs + j] * x[j];
            if (layer + 1 < r->layers) {
                if (r->activation == 0) sum = tanh(sum);
                if (r->activation == 1) sum = fmax(sum, 0.0);
                if (r->activation == 2) sum = 1.0 / (1.0 + exp(-sum));
            }
            y[i] = sum;
        }
        w += (inputs + 1) * outputs;
        x = y;
        y = done;
    }
    return x;
}

void gapscope_hybrid_step(gapscope_state *state, const gapscope_residual *residual, const double *tau)
{
    const double *r = correction(residual, state, tau);
    double sum[N];
    int j;
    for (j = 0; j < N; j++) sum[j] = residual->on == 2 ? tau[j] + r[j] : tau[j];
    gapscope_step(state, sum);
    for (j = 0; j < N; j++) {
        if (residual->on == 0) {
            state->q[j] += r[j];
            state->v[j] += r[N + j];
        } else if (residual->on == 1) {
            state->q[j] += GAPSCOPE_DT * GAPSCOPE_DT * r[j];
            state->v[j] += GAPSCOPE_DT * r[j];
        }
    }
}

#endif
