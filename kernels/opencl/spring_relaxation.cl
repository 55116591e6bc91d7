// Springs between the bones of a body, relaxed frame by frame.
// Twin of relax_springs and relax_frame in kernels/calibration/springs.py; read after components.cl.
//
// Shapes, REAL, row first and frame last:
//   position (3 S, frames), turned (4 S, frames)   sensors, from an origin of each frame's own; wxyz, unit
//   body     (S, 11)         from the bone's centre: its joint (3), its sensor (3), from the parent's centre: its joint (3);
//                            1 / moment of inertia, stiffness of the spring to the sensor
//   place    (3 S, frames), answer (4 S, frames), output: origins and rotations of the bones
// spring_relaxation: one work-item owns a frame. spring_relaxation_serial: one work-item goes through all frames.
// Build options: REAL, LANES (as in components.cl; 1), S (bones), PARENTS (a list), JOINT, KEPT (as in the twin).
//
// No frame sees another: the serial and the parallel run give the same bits.

#define PROXIMAL(s) (body + 11 * (s))
#define SENSOR(s) (body + 11 * (s) + 3)
#define ATTACHMENT(s) (body + 11 * (s) + 6)
#define TURNABILITY(s) body[11 * (s) + 9]
#define HOLD(s) body[11 * (s) + 10]
#define AT(base, row) (base)[(size_t)(row) * frames + frame]

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
    const V3 still = {(REAL)0, (REAL)0, (REAL)0};
    Q4 q[S];
    V3 at[S], x[S], v[S], w[S], force[S], torque[S];
    for (int s = 0; s < S; ++s) {
        const Q4 said = {AT(turned, 4 * s), AT(turned, 4 * s + 1), AT(turned, 4 * s + 2), AT(turned, 4 * s + 3)};
        const V3 seen = {AT(position, 3 * s), AT(position, 3 * s + 1), AT(position, 3 * s + 2)};
        q[s] = said;
        at[s] = seen;
        x[s] = subtract(seen, carry(said, SENSOR(s)));
        v[s] = w[s] = still;
    }
    for (int step = 0; step < iterations; ++step) {
        for (int s = 0; s < S; ++s) {
            const V3 lever = carry(q[s], SENSOR(s));
            force[s] = scale(HOLD(s), subtract(at[s], add(x[s], lever)));
            torque[s] = cross3(lever, force[s]);
        }
        for (int c = 1; c < S; ++c) {
            const int p = parent[c];
            const V3 own = carry(q[c], PROXIMAL(c)), on_parent = carry(q[p], ATTACHMENT(c));
            const V3 pull = scale((REAL)JOINT, subtract(add(x[p], on_parent), add(x[c], own)));
            force[c] = add(force[c], pull);
            torque[c] = add(torque[c], cross3(own, pull));
            force[p] = subtract(force[p], pull);
            torque[p] = subtract(torque[p], cross3(on_parent, pull));
        }
        for (int s = 0; s < S; ++s) {
            v[s] = scale((REAL)KEPT, add(v[s], force[s]));
            w[s] = scale((REAL)KEPT, add(w[s], scale(TURNABILITY(s), torque[s])));
            x[s] = add(x[s], v[s]);
            q[s] = turn(q[s], w[s]);
        }
    }
    for (int s = 0; s < S; ++s) {
        const V3 origin = add(x[s], carry(q[s], PROXIMAL(s)));
        AT(place, 3 * s) = origin.x;
        AT(place, 3 * s + 1) = origin.y;
        AT(place, 3 * s + 2) = origin.z;
        AT(answer, 4 * s) = q[s].w;
        AT(answer, 4 * s + 1) = q[s].x;
        AT(answer, 4 * s + 2) = q[s].y;
        AT(answer, 4 * s + 3) = q[s].z;
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
