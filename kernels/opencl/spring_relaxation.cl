// Springs between the bones of a body, relaxed frame by frame.
// Twin of relax_springs and relax_frame in kernels/calibration/springs.py.
//
// Shapes, REAL, row first and frame last:
//   position (3 S, frames), turned (4 S, frames)   sensors; wxyz, unit
//   body     (S, 11)         from the bone's centre: its joint (3), its sensor (3), from the parent's centre: its joint (3);
//                            1 / moment of inertia, stiffness of the spring to the sensor
//   place    (3 S, frames), answer (4 S, frames), output: origins and rotations of the bones
// spring_relaxation: one work-item owns a frame. spring_relaxation_serial: one work-item goes through all frames.
// Build options: REAL (float or double), S (bones), PARENTS (a list), JOINT, KEPT (as in the twin).
//
// What is done is plain arithmetic, square roots and divisions in a fixed order, and no frame sees another: the serial and
// the parallel run give the same bits.

#pragma OPENCL FP_CONTRACT OFF

#ifdef cl_khr_fp64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif

#define TWO ((REAL)2)

static void carry(const REAL *q, const REAL a, const REAL b, const REAL c, REAL *v)
{
    const REAL tx = TWO * (q[2] * c - q[3] * b);
    const REAL ty = TWO * (q[3] * a - q[1] * c);
    const REAL tz = TWO * (q[1] * b - q[2] * a);
    v[0] = a + q[0] * tx + (q[2] * tz - q[3] * ty);
    v[1] = b + q[0] * ty + (q[3] * tx - q[1] * tz);
    v[2] = c + q[0] * tz + (q[1] * ty - q[2] * tx);
}

static void relax(
    const int frame,
    const int frames,
    const int iterations,
    __global const REAL *position,
    __global const REAL *turned,
    __constant REAL *body,
    __global REAL *place,
    __global REAL *answer)
{
    const int parent[S] = {PARENTS};
    REAL q[S][4], x[S][3], v[S][3], w[S][3], force[S][3], torque[S][3], at[S][3];
    for (int s = 0; s < S; ++s) {
        __constant const REAL *b = body + 11 * s;
        for (int k = 0; k < 4; ++k)
            q[s][k] = turned[(size_t)(4 * s + k) * frames + frame];
        REAL a[3];
        carry(q[s], b[3], b[4], b[5], a);
        for (int i = 0; i < 3; ++i) {
            at[s][i] = position[(size_t)(3 * s + i) * frames + frame];
            x[s][i] = at[s][i] - a[i];
            v[s][i] = w[s][i] = (REAL)0;
        }
    }
    for (int step = 0; step < iterations; ++step) {
        for (int s = 0; s < S; ++s) {
            __constant const REAL *b = body + 11 * s;
            REAL a[3], f[3];
            carry(q[s], b[3], b[4], b[5], a);
            for (int i = 0; i < 3; ++i) {
                f[i] = b[10] * (at[s][i] - (x[s][i] + a[i]));
                force[s][i] = f[i];
            }
            torque[s][0] = a[1] * f[2] - a[2] * f[1];
            torque[s][1] = a[2] * f[0] - a[0] * f[2];
            torque[s][2] = a[0] * f[1] - a[1] * f[0];
        }
        for (int c = 1; c < S; ++c) {
            __constant const REAL *own = body + 11 * c;
            const int p = parent[c];
            REAL a[3], b[3], f[3];
            carry(q[c], own[0], own[1], own[2], a);
            carry(q[p], own[6], own[7], own[8], b);
            for (int i = 0; i < 3; ++i) {
                f[i] = (REAL)JOINT * ((x[p][i] + b[i]) - (x[c][i] + a[i]));
                force[c][i] += f[i];
                force[p][i] -= f[i];
            }
            torque[c][0] += a[1] * f[2] - a[2] * f[1];
            torque[c][1] += a[2] * f[0] - a[0] * f[2];
            torque[c][2] += a[0] * f[1] - a[1] * f[0];
            torque[p][0] -= b[1] * f[2] - b[2] * f[1];
            torque[p][1] -= b[2] * f[0] - b[0] * f[2];
            torque[p][2] -= b[0] * f[1] - b[1] * f[0];
        }
        for (int s = 0; s < S; ++s) {
            const REAL turnability = body[11 * s + 9];
            for (int i = 0; i < 3; ++i) {
                v[s][i] = (REAL)KEPT * (v[s][i] + force[s][i]);
                w[s][i] = (REAL)KEPT * (w[s][i] + torque[s][i] * turnability);
                x[s][i] += v[s][i];
            }
            const REAL hx = (REAL)0.5 * w[s][0], hy = (REAL)0.5 * w[s][1], hz = (REAL)0.5 * w[s][2];
            const REAL a = q[s][0], b = q[s][1], c = q[s][2], d = q[s][3];
            const REAL e = a - hx * b - hy * c - hz * d, f = b + hx * a + hy * d - hz * c;
            const REAL g = c - hx * d + hy * a + hz * b, h = d + hx * c - hy * b + hz * a;
            const REAL length = sqrt(e * e + f * f + g * g + h * h);
            q[s][0] = e / length;
            q[s][1] = f / length;
            q[s][2] = g / length;
            q[s][3] = h / length;
        }
    }
    for (int s = 0; s < S; ++s) {
        __constant const REAL *b = body + 11 * s;
        REAL a[3];
        carry(q[s], b[0], b[1], b[2], a);
        for (int i = 0; i < 3; ++i)
            place[(size_t)(3 * s + i) * frames + frame] = x[s][i] + a[i];
        for (int k = 0; k < 4; ++k)
            answer[(size_t)(4 * s + k) * frames + frame] = q[s][k];
    }
}

__kernel void spring_relaxation(
    const int iterations,
    const int frames,
    __global const REAL *restrict position,
    __global const REAL *restrict turned,
    __constant REAL *restrict body,
    __global REAL *restrict place,
    __global REAL *restrict answer)
{
    const int frame = get_global_id(0);
    if (frame < frames)
        relax(frame, frames, iterations, position, turned, body, place, answer);
}

__kernel void spring_relaxation_serial(
    const int iterations,
    const int frames,
    __global const REAL *restrict position,
    __global const REAL *restrict turned,
    __constant REAL *restrict body,
    __global REAL *restrict place,
    __global REAL *restrict answer)
{
    for (int frame = 0; frame < frames; ++frame)
        relax(frame, frames, iterations, position, turned, body, place, answer);
}
