/* The CASE 2 loop by hand: decoupled joints (9) under PD (11) on a noisy position and its velocity
   through G1 (47), the model (19), the filters G2 (34) and the composite update law (40), with
   Dormand-Prince of fixed step.  Two joints, 22 states, in the order of the compiled diagram:
   q dq | q_model dq_model | G1 of joint 1, of joint 2 | dq_f | u_f | a_hat b_hat d_hat. */
#include <math.h>
#include <string.h>

#define NX 22
#define PI 3.14159265358979323846

typedef struct {
    double a[2], b[2], d[2], kp[2], kd[2], q_d[2];
    double gamma, alpha, highpass, lowpass, omega_f;
} Robot;

static inline __attribute__((always_inline)) void
derivative(double t, const double *x, const double *noise, const Robot *r, double *dx)
{
    const double pe = 0.7 * sin(2 * PI * t) + 0.5 * sin(PI * t) - 0.25 * cos(PI * t);
    const double ramp = 1.0 - exp(-r->omega_f * t);
    for (int j = 0; j < 2; j++) {
        const double q = x[j] + noise[j], dq = x[2 + j];
        const double q_model = x[4 + j], dq_model = x[6 + j];
        const double g1 = x[8 + 2 * j], velocity = x[9 + 2 * j];
        const double dq_f = x[12 + j], u_f = x[14 + j];
        const double a_hat = x[16 + j], b_hat = x[18 + j], d_hat = x[20 + j];

        const double u = r->kp[j] * (r->q_d[j] - q) - r->kd[j] * velocity + pe;
        const double u_model = r->kp[j] * (r->q_d[j] - q_model) - r->kd[j] * dq_model + pe;
        dx[j] = dq;
        dx[2 + j] = -r->a[j] * dq + r->b[j] * u - r->d[j];
        dx[4 + j] = dq_model;
        dx[6 + j] = -a_hat * dq_model + b_hat * u_model - d_hat;
        dx[8 + 2 * j] = r->highpass * (q - g1);
        dx[9 + 2 * j] = r->lowpass * (r->highpass * (q - g1) - velocity);

        const double y_f = r->omega_f * (velocity - dq_f);
        const double e_f = -a_hat * dq_f + b_hat * u_f - ramp * d_hat - y_f;
        const double weighted = r->kd[j] / r->kp[j] * (u_model - u);
        const double gradient = r->alpha * r->gamma * e_f;
        dx[12 + j] = y_f;
        dx[14 + j] = r->omega_f * (u - u_f);
        dx[16 + j] = -r->gamma * dq_model * weighted + gradient * dq_f;
        dx[18 + j] = r->gamma * u_model * weighted - gradient * u_f;
        dx[20 + j] = -r->gamma * weighted + gradient * ramp;
    }
}

#define STAGE(sum) for (int i = 0; i < NX; i++) y[i] = x[i] + h * (sum)

void run(long n, double h, double *x, const double *noise, const Robot *r, long every, double *log)
{
    double k1[NX], k2[NX], k3[NX], k4[NX], k5[NX], k6[NX], y[NX];
    for (long s = 0; s < n; s++, noise += 2) {
        const double t = s * h;
        if (s % every == 0) {
            memcpy(log, x, sizeof k1);
            log += NX;
        }
        derivative(t, x, noise, r, k1);
        STAGE(k1[i] / 5);
        derivative(t + h / 5, y, noise, r, k2);
        STAGE(3. / 40 * k1[i] + 9. / 40 * k2[i]);
        derivative(t + 3 * h / 10, y, noise, r, k3);
        STAGE(44. / 45 * k1[i] - 56. / 15 * k2[i] + 32. / 9 * k3[i]);
        derivative(t + 4 * h / 5, y, noise, r, k4);
        STAGE(19372. / 6561 * k1[i] - 25360. / 2187 * k2[i] + 64448. / 6561 * k3[i]
              - 212. / 729 * k4[i]);
        derivative(t + 8 * h / 9, y, noise, r, k5);
        STAGE(9017. / 3168 * k1[i] - 355. / 33 * k2[i] + 46732. / 5247 * k3[i]
              + 49. / 176 * k4[i] - 5103. / 18656 * k5[i]);
        derivative(t + h, y, noise, r, k6);
        for (int i = 0; i < NX; i++)
            x[i] += h * (35. / 384 * k1[i] + 500. / 1113 * k3[i] + 125. / 192 * k4[i]
                         - 2187. / 6784 * k5[i] + 11. / 84 * k6[i]);
    }
    if (n % every == 0)
        memcpy(log, x, sizeof k1);
}
