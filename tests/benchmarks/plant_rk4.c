/* The two-axis plant, written by hand: the same right-hand side as the package's, RK4 at a fixed step.
 *
 * Elastic base, azimuth about z, elevation about -y, level transducer, no misalignment. Coulomb friction
 * is regularised, as RK4 needs. It is the yardstick of tests/benchmarks/test_plant.py; it has no
 * amplifier and no encoders.
 */
#include <math.h>

enum { BODY = 10, STATES = 14 };

typedef struct {
    double g, k[3], c[3], height;
    double base[BODY], azimuth[BODY], antenna[BODY]; /* mass, first moment, tensor about the link's origin */
    double Jr, R, Tmax, Kangle, tcog, b_m, d0, d1, w_dyn, Ts0, delta, width, fsv, Ka;
} Rig;

static inline void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* n = I w + h x v, f = m v + w x h */
static inline void momentum(const double *I, const double *w, const double *v, double *n, double *f) {
    const double *h = I + 1;
    n[0] = I[4] * w[0] + I[7] * w[1] + I[8] * w[2] + h[1] * v[2] - h[2] * v[1];
    n[1] = I[7] * w[0] + I[5] * w[1] + I[9] * w[2] + h[2] * v[0] - h[0] * v[2];
    n[2] = I[8] * w[0] + I[9] * w[1] + I[6] * w[2] + h[0] * v[1] - h[1] * v[0];
    cross(w, h, f);
    for (int i = 0; i < 3; i++) f[i] += I[0] * v[i];
}

/* Body of a link with axes X, Y, Z (columns) and origin (0, 0, height), referred to T's origin. */
static inline void place(const double *b, const double R[9], double height, double *I) {
    double T[3][3] = {{b[4], b[7], b[8]}, {b[7], b[5], b[9]}, {b[8], b[9], b[6]}}, A[3][3], S[3][3], h[3];
    for (int i = 0; i < 3; i++) {
        h[i] = R[3 * i] * b[1] + R[3 * i + 1] * b[2] + R[3 * i + 2] * b[3];
        for (int j = 0; j < 3; j++) A[i][j] = R[3 * i] * T[0][j] + R[3 * i + 1] * T[1][j] + R[3 * i + 2] * T[2][j];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            S[i][j] = A[i][0] * R[3 * j] + A[i][1] * R[3 * j + 1] + A[i][2] * R[3 * j + 2];
    double lift = height * (b[0] * height + 2.0 * h[2]);
    I[0] = b[0], I[1] = h[0], I[2] = h[1], I[3] = h[2] + b[0] * height;
    I[4] = S[0][0] + lift, I[5] = S[1][1] + lift, I[6] = S[2][2];
    I[7] = S[0][1], I[8] = S[0][2] - height * h[0], I[9] = S[1][2] - height * h[1];
}

static void drive(const Rig *p, double field, double th, double w, double q, double qd, double *rotor, double *gear) {
    double full = p->w_dyn, share = fmax(-1.0, fmin(1.0, w / full));
    double phase = 200.0 * th;
    phase -= 2.0 * M_PI * floor(phase / (2.0 * M_PI) + 0.5);
    *gear = p->fsv * (w / p->R - qd) + p->Ka * (th / p->R - q);
    *rotor = p->Tmax * sin(p->Kangle * (field - th)) + p->tcog * sin(200.0 * th) - p->b_m * w
             - (p->d0 + p->d1 * sin(2.0 * th)) * share - *gear / p->R;
    if (fabs(phase) < p->delta) *rotor -= p->Ts0 * fmax(-1.0, fmin(1.0, w / p->width));
}

/* State: alpha[3], omega[3], q[2], qd[2], theta[2], spin[2]; wrench: force, then torque, on the transducer. */
static void rates(const Rig *p, const double *x, const double *field, double *dx, double *wrench) {
    const double *al = x, *om = x + 3, *q = x + 6, *qd = x + 8, *th = x + 10, *s = x + 12;
    double c1 = cos(al[0]), s1 = sin(al[0]), c2 = cos(al[1]), s2 = sin(al[1]), c3 = cos(al[2]), s3 = sin(al[2]);
    double ca = cos(q[0]), sa = sin(q[0]), ce = cos(q[1]), se = sin(q[1]);
    double rate0 = (c3 * om[0] - s3 * om[1]) / c2;
    dx[0] = rate0, dx[1] = s3 * om[0] + c3 * om[1], dx[2] = om[2] - s2 * rate0;
    double Q[3];
    for (int i = 0; i < 3; i++) Q[i] = -p->k[i] * al[i] - p->c[i] * dx[i];
    double X = (Q[0] - s2 * Q[2]) / c2, M[3] = {c3 * X + s3 * Q[1], c3 * Q[1] - s3 * X, Q[2]};
    double gy = -s1 * p->g, gz = -c1 * p->g, gx = -s2 * gz;
    double up[3] = {-(c3 * gx + s3 * gy), -(c3 * gy - s3 * gx), -c2 * gz};

    double Ra[9] = {ca, -sa, 0, sa, ca, 0, 0, 0, 1};
    double Re[9] = {ca * ce, -sa, -ca * se, sa * ce, ca, -sa * se, se, 0, ce};
    double a0[3] = {0, 0, 1}, a1[3] = {sa, -ca, 0}, m0[3] = {0, 0, 0}, o[3] = {0, 0, p->height}, m1[3];
    cross(o, a1, m1);
    double Ia[BODY], Ie[BODY], zero[3] = {0, 0, 0};
    place(p->azimuth, Ra, p->height, Ia);
    place(p->antenna, Re, p->height, Ie);

    double w0[3], w1[3], v1[3], y[3], alpha1[3], acc1[3];
    for (int i = 0; i < 3; i++) w0[i] = om[i] + a0[i] * qd[0];
    for (int i = 0; i < 3; i++) w1[i] = w0[i] + a1[i] * qd[1], v1[i] = m1[i] * qd[1];
    double alpha0[3], acc0[3], t[3];
    cross(om, a0, alpha0);
    for (int i = 0; i < 3; i++) alpha0[i] *= qd[0], acc0[i] = up[i];
    cross(w0, a1, y);
    cross(w0, m1, t);
    for (int i = 0; i < 3; i++) alpha1[i] = alpha0[i] + y[i] * qd[1], acc1[i] = acc0[i] + t[i] * qd[1];

    double n[3][3], f[3][3];
    const double *I[3] = {p->base, Ia, Ie}, *W[3] = {om, w0, w1}, *V[3] = {zero, zero, v1};
    const double *al_[3] = {zero, alpha0, alpha1}, *ac_[3] = {up, acc0, acc1};
    for (int b = 0; b < 3; b++) {
        double L[3], P[3], u[3], v[3], z[3];
        momentum(I[b], al_[b], ac_[b], n[b], f[b]);
        momentum(I[b], W[b], V[b], L, P);
        cross(W[b], L, u), cross(V[b], P, v), cross(W[b], P, z);
        for (int i = 0; i < 3; i++) n[b][i] += u[i] + v[i], f[b][i] += z[i];
    }
    double carrier[2] = {dot(a0, om), dot(a1, w0)}, torque[2], gear[2];
    for (int j = 0; j < 2; j++) {
        double w = s[j] - carrier[j];
        drive(p, field[j], th[j], w, q[j], qd[j], torque + j, gear + j);
        dx[10 + j] = w, dx[12 + j] = torque[j] / p->Jr;
    }
    cross(om, a0, y), cross(w0, a1, t);
    for (int i = 0; i < 3; i++) {
        n[0][i] += torque[0] * a0[i] + p->Jr * s[0] * y[i];
        n[1][i] += torque[1] * a1[i] + p->Jr * s[1] * t[i];
    }
    double U1n[3], U1f[3], U0n[3], U0f[3], Iae[BODY], It[BODY];
    momentum(Ie, a1, m1, U1n, U1f);
    double b1 = gear[1] - dot(a1, n[2]) - dot(m1, f[2]);
    for (int i = 0; i < BODY; i++) Iae[i] = Ia[i] + Ie[i], It[i] = Iae[i] + p->base[i];
    for (int i = 0; i < 3; i++) n[1][i] += n[2][i], f[1][i] += f[2][i];
    momentum(Iae, a0, m0, U0n, U0f);
    double b0 = gear[0] - dot(a0, n[1]);
    for (int i = 0; i < 3; i++) n[0][i] += n[1][i], f[0][i] += f[1][i];

    double A[5][5] = {{It[4]}, {It[7], It[5]}, {It[8], It[9], It[6]}};
    for (int i = 0; i < 3; i++) A[3][i] = U0n[i], A[4][i] = U1n[i];
    A[3][3] = dot(a0, U0n), A[4][3] = dot(a0, U1n), A[4][4] = dot(a1, U1n) + dot(m1, U1f);
    double r[5] = {M[0] - n[0][0], M[1] - n[0][1], M[2] - n[0][2], b0, b1}, D[5];
    for (int j = 0; j < 5; j++) {
        D[j] = A[j][j];
        for (int m = 0; m < j; m++) D[j] -= A[j][m] * A[j][m] * D[m];
        for (int i = j + 1; i < 5; i++) {
            for (int m = 0; m < j; m++) A[i][j] -= A[i][m] * A[j][m] * D[m];
            A[i][j] /= D[j];
        }
        for (int m = 0; m < j; m++) r[j] -= A[j][m] * r[m];
    }
    for (int i = 4; i >= 0; i--) {
        r[i] /= D[i];
        for (int m = i + 1; m < 5; m++) r[i] -= A[m][i] * r[m];
    }
    for (int i = 0; i < 3; i++) dx[3 + i] = r[i];
    dx[6] = qd[0], dx[7] = qd[1], dx[8] = r[3], dx[9] = r[4];
    double Pn[3], Pf[3];
    momentum(It, r, zero, Pn, Pf);
    for (int i = 0; i < 3; i++) {
        wrench[i] = -(f[0][i] + Pf[i] + U0f[i] * r[3] + U1f[i] * r[4]);
        wrench[3 + i] = -(n[0][i] + Pn[i] + U0n[i] * r[3] + U1n[i] * r[4]);
    }
}

/* Advance `steps` steps; the field moves linearly between `cycles` (motor rad) and is rounded to microsteps. */
void run(const Rig *p, double *x, long steps, double h, double cycle, const double *fields, long every, double *out) {
    const double microstep = 2.0 * M_PI / 12800.0, at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1, 2, 2, 1};
    for (long n = 0; n < steps; n++) {
        double sum[STATES] = {0}, k[STATES] = {0}, y[STATES], wrench[6], field[2];
        for (int stage = 0; stage < 4; stage++) {
            double t = (n + at[stage]) * h / cycle;
            long c = (long)t;
            for (int j = 0; j < 2; j++) {
                double f = fields[2 * c + j] + (t - c) * (fields[2 * c + 2 + j] - fields[2 * c + j]);
                field[j] = floor(f / microstep + 0.5) * microstep;
            }
            for (int i = 0; i < STATES; i++) y[i] = x[i] + at[stage] * h * k[i];
            rates(p, y, field, k, wrench);
            if (stage == 0 && n % every == 0)
                for (int i = 0; i < 6; i++) out[6 * (n / every) + i] = wrench[i];
            for (int i = 0; i < STATES; i++) sum[i] += weight[stage] * k[i];
        }
        for (int i = 0; i < STATES; i++) x[i] += h / 6.0 * sum[i];
    }
}
