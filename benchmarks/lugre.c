/* The exact LuGre step of idtool/model/lugre.py in C, to be compared with the compiled Python.
 *
 * lugre           the same loop, row by row
 * lugre_tangents  the same with derivatives
 * lugre_many      several stiffnesses at once, laid out so that a vector unit takes a lane each
 */
#include <math.h>
#include <stdint.h>

static const double SMALL = 1e-5;

void lugre(int64_t n, const double *velocity, const double *step, const double *rho,
           const uint8_t *first, const double *start, double *z, double *decay)
{
    double state = 0.0, fade = 1.0;
    int64_t trial = -1;
    for (int64_t k = 0; k < n; k++) {
        if (first[k]) {
            state = start[++trial];
            fade = 1.0;
        } else {
            double x = rho[k] * fabs(velocity[k]) * step[k];
            double e = exp(-x);
            double forced;
            if (x > SMALL)
                forced = copysign((1.0 - e) / rho[k], velocity[k]);
            else
                forced = velocity[k] * step[k] * (1.0 - 0.5 * x);
            state = e * state + forced;
            fade *= e;
        }
        z[k] = state;
        decay[k] = fade;
    }
}

void lugre_tangents(int64_t n, int64_t m, const double *velocity, const double *step, const double *rho,
                    const uint8_t *first, const double *start, const double *dlog_rho, double *kept,
                    double *sensitivity, double *z, double *decay, double *tangents)
{
    double state = 0.0, fade = 1.0;
    int64_t trial = -1;
    for (int64_t k = 0; k < n; k++) {
        if (first[k]) {
            state = start[++trial];
            fade = 1.0;
            kept[k] = sensitivity[k] = 0.0;
        } else {
            double x = rho[k] * fabs(velocity[k]) * step[k];
            double e = exp(-x);
            double forced, s;
            if (x > SMALL) {
                forced = copysign((1.0 - e) / rho[k], velocity[k]);
                s = -copysign((1.0 - e - x * e) / rho[k], velocity[k]);
            } else {
                forced = velocity[k] * step[k] * (1.0 - 0.5 * x);
                s = -0.5 * x * velocity[k] * step[k];
            }
            kept[k] = e;
            sensitivity[k] = s - x * e * state;
            state = e * state + forced;
            fade *= e;
        }
        z[k] = state;
        decay[k] = fade;
    }
    for (int64_t j = 0; j < m; j++) {
        const double *direction = dlog_rho + j * n;
        double *tangent = tangents + j * n;
        double running = 0.0;
        for (int64_t k = 0; k < n; k++) {
            running = kept[k] * running + sensitivity[k] * direction[k];
            tangent[k] = running;
        }
    }
}

/* LANES candidates at once: inverse[k] = 1 / g of the row, stiffness[c] of the candidate. No branch is
 * left in the inner loop; where x is small, (1 - e) / rho loses digits, which this version accepts. */
#define LANES 16
void lugre_many(int64_t n, const double *velocity, const double *step, const double *inverse,
                const uint8_t *first, const double *stiffness, double *z)
{
    double state[LANES] = {0.0};
    for (int64_t k = 0; k < n; k++) {
        double speed = fabs(velocity[k]) * step[k] * inverse[k];
        double top = copysign(1.0 / inverse[k], velocity[k]);
        double keep = first[k] ? 0.0 : 1.0;
        for (int c = 0; c < LANES; c++) {
            double e = exp(-stiffness[c] * speed);
            state[c] = keep * (e * state[c] + top * (1.0 - e) / stiffness[c]);
            z[k * LANES + c] = state[c];
        }
    }
}

/* One candidate, the exponentials first in a loop of their own that vectorises, then the recursion. */
void lugre_split(int64_t n, const double *velocity, const double *step, const double *rho,
                 const uint8_t *first, const double *start, double *z, double *decay)
{
    enum { BLOCK = 512 };
    double e[BLOCK], forced[BLOCK];
    double state = 0.0, fade = 1.0;
    int64_t trial = -1;
    for (int64_t begin = 0; begin < n; begin += BLOCK) {
        int64_t size = n - begin < BLOCK ? n - begin : BLOCK;
        for (int64_t i = 0; i < size; i++) {
            double w = velocity[begin + i], h = step[begin + i], r = rho[begin + i];
            double x = r * fabs(w) * h;
            double decayed = exp(-x);
            double large = copysign((1.0 - decayed) / r, w);
            double small = w * h * (1.0 - 0.5 * x);
            e[i] = decayed;
            forced[i] = x > SMALL ? large : small;
        }
        for (int64_t i = 0; i < size; i++) {
            if (first[begin + i]) {
                state = start[++trial];
                fade = 1.0;
            } else {
                state = e[i] * state + forced[i];
                fade *= e[i];
            }
            z[begin + i] = state;
            decay[begin + i] = fade;
        }
    }
}
