/* The law of my_law.py in C: PID with feedforward of a weight, 1 kHz. */

#include <math.h>

#define JOINTS 2
#define PERIOD 1e-3

void controller(const double q_d[], const double q[], const double pe[],
                const double kp[], const double ki[], const double kd[], const double weight[],
                double limit, double integral[JOINTS], double last[JOINTS], double u[])
{
    for (int k = 0; k < JOINTS; k++) {
        double error = q_d[k] - q[k];
        double command = kp[k] * error + ki[k] * integral[k] + kd[k] * (error - last[k]) / PERIOD
                         + weight[k] * cos(q[k]) + pe[k];
        if (fabs(command) < limit)
            integral[k] += PERIOD * error;
        last[k] = error;
        u[k] = fmin(fmax(command, -limit), limit);
    }
}
