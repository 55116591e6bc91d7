// Gauss-Newton on the tree of a body, frame by frame.
// Twin of solve_tree in kernels/calibration/tree_solver.py.
//
// Shapes, REAL, row first and frame last, frames padded to whole vectors by repeating the last:
//   position (3 S, stride)   sensors, from an origin of each frame's own
//   turned   (4 S, stride)   what the sensors say, wxyz, unit
//   weight   (S, stride)
//   body     (S, 8)          sensor in its bone's frame (3), proximal joint in the parent's (3), 1 / variance of positions
//                            and of rotations
//   place    (3 S, stride), answer (4 S, stride), output: origins and rotations of the bones
// One work-item owns LANES frames. Build options: REAL (float or double), LANES (1, 2, 4, 8, 16), S (bones), PARENTS (their
// parents, a list), DAMPING (as in the twin), KIND (three times the twin's KINDNESS, in the variances' unit).
//
// What is done is plain arithmetic, square roots and divisions in a fixed order, and no frame sees another.

#pragma OPENCL FP_CONTRACT OFF

#ifdef cl_khr_fp64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#endif

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#if LANES == 1
#define VEC REAL
#else
#define VEC JOIN(REAL, LANES)
#endif
#define AT(base, row) (*(__global const VEC *)((base) + (size_t)(row) * stride + frame))
#define PUT(base, row) (*(__global VEC *)((base) + (size_t)(row) * stride + frame))
#define DOT(ax, ay, az, bx, by, bz) ((ax) * (bx) + (ay) * (by) + (az) * (bz))

typedef struct { VEC x, y, z; } V3;

static V3 cross3(const V3 a, const V3 b)
{
    V3 c;
    c.x = a.y * b.z - a.z * b.y;
    c.y = a.z * b.x - a.x * b.z;
    c.z = a.x * b.y - a.y * b.x;
    return c;
}

// v + 2 w (u x v) + 2 u x (u x v): a constant vector carried by a quaternion
static V3 carry(const VEC *q, const REAL a, const REAL b, const REAL c)
{
    const VEC tx = (REAL)2 * (q[2] * c - q[3] * b);
    const VEC ty = (REAL)2 * (q[3] * a - q[1] * c);
    const VEC tz = (REAL)2 * (q[1] * b - q[2] * a);
    V3 v;
    v.x = a + q[0] * tx + (q[2] * tz - q[3] * ty);
    v.y = b + q[0] * ty + (q[3] * tx - q[1] * tz);
    v.z = c + q[0] * tz + (q[1] * ty - q[2] * tx);
    return v;
}

// C x = b for a symmetric positive C, as L D L^T with the diagonal inverted
typedef struct { VEC d0, d1, d2, l10, l20, l21; } Factor;

static Factor factor(const VEC c00, const VEC c01, const VEC c02, const VEC c11, const VEC c12, const VEC c22)
{
    Factor f;
    f.d0 = (REAL)1 / c00;
    f.l10 = c01 * f.d0;
    f.l20 = c02 * f.d0;
    f.d1 = (REAL)1 / (c11 - f.l10 * c01);
    const VEC rest = c12 - f.l20 * c01;
    f.l21 = rest * f.d1;
    f.d2 = (REAL)1 / (c22 - f.l20 * c02 - f.l21 * rest);
    return f;
}

static V3 solve3(const Factor f, const VEC bx, const VEC by, const VEC bz)
{
    const VEC y1 = by - f.l10 * bx;
    const VEC y2 = bz - f.l20 * bx - f.l21 * y1;
    V3 v;
    v.z = y2 * f.d2;
    v.y = y1 * f.d1 - f.l21 * v.z;
    v.x = bx * f.d0 - f.l10 * v.y - f.l20 * v.z;
    return v;
}

__kernel void tree_gauss_newton(
    const int iterations,
    const int stride,
    __global const REAL *restrict position,
    __global const REAL *restrict turned,
    __global const REAL *restrict weight,
    __constant REAL *restrict body,
    __global REAL *restrict place,
    __global REAL *restrict answer)
{
    const int frame = get_global_id(0) * LANES;
    if (frame >= stride)
        return;
    const int parent[S] = {PARENTS};

    VEC q[S][4];
    V3 p[S], bone[S], arm[S];
    // sums over what hangs below: A (6), B (9), C (6), g (3), h (3)
    VEC A[S][6], B[S][9], C[S][6];
    V3 g[S], h[S], X[S][4];

    for (int s = 0; s < S; ++s)
        for (int k = 0; k < 4; ++k)
            q[s][k] = AT(turned, 4 * s + k);
    p[0].x = AT(position, 0);
    p[0].y = AT(position, 1);
    p[0].z = AT(position, 2);

    for (int step = 0; step < iterations; ++step) {
        for (int s = 0; s < S; ++s) {
            __constant const REAL *b = body + 8 * s;
            arm[s] = carry(q[s], b[0], b[1], b[2]);
            if (s > 0) {
                bone[s] = carry(q[parent[s]], b[3], b[4], b[5]);
                p[s].x = p[parent[s]].x + bone[s].x;
                p[s].y = p[parent[s]].y + bone[s].y;
                p[s].z = p[parent[s]].z + bone[s].z;
            }
            for (int k = 0; k < 6; ++k)
                A[s][k] = C[s][k] = (VEC)((REAL)0);
            for (int k = 0; k < 9; ++k)
                B[s][k] = (VEC)((REAL)0);
            g[s].x = g[s].y = g[s].z = (VEC)((REAL)0);
            h[s] = g[s];
        }
        for (int s = S - 1; s >= 0; --s) {
            __constant const REAL *b = body + 8 * s;
            const V3 a = arm[s];
            V3 r, phi;
            r.x = AT(position, 3 * s) - p[s].x - a.x;
            r.y = AT(position, 3 * s + 1) - p[s].y - a.y;
            r.z = AT(position, 3 * s + 2) - p[s].z - a.z;

            // vector part of said q^-1, doubled, by the arcsine's series
            const VEC sw = AT(turned, 4 * s), sx = AT(turned, 4 * s + 1);
            const VEC sy = AT(turned, 4 * s + 2), sz = AT(turned, 4 * s + 3);
            const VEC w = sw * q[s][0] + sx * q[s][1] + sy * q[s][2] + sz * q[s][3];
            const VEC two = w < (VEC)((REAL)0) ? (VEC)((REAL)-2) : (VEC)((REAL)2);
            phi.x = two * (-sw * q[s][1] + sx * q[s][0] - sy * q[s][3] + sz * q[s][2]);
            phi.y = two * (-sw * q[s][2] + sx * q[s][3] + sy * q[s][0] - sz * q[s][1]);
            phi.z = two * (-sw * q[s][3] - sx * q[s][2] + sy * q[s][1] + sz * q[s][0]);
            const VEC square = (REAL)0.25 * DOT(phi.x, phi.y, phi.z, phi.x, phi.y, phi.z);
            const VEC longer = (REAL)1 + square * ((REAL)(1.0 / 6.0) + square * ((REAL)(3.0 / 40.0) + square * (REAL)(15.0 / 336.0)));
            phi.x *= longer;
            phi.y *= longer;
            phi.z *= longer;

            const VEC belief = AT(weight, s);
            VEC wp = belief * b[6], wr = belief * b[7];
            if (step > 0) {
                const VEC up = (REAL)1 + DOT(r.x, r.y, r.z, r.x, r.y, r.z) * (b[6] / (REAL)KIND);
                const VEC ur = (REAL)1 + DOT(phi.x, phi.y, phi.z, phi.x, phi.y, phi.z) * (b[7] / (REAL)KIND);
                wp /= up * up;
                wr /= ur * ur;
            }
            const VEC damped = wr + (REAL)DAMPING * b[7];
            const VEC ax2 = a.x * a.x, ay2 = a.y * a.y, az2 = a.z * a.z;
            A[s][0] += wp;
            A[s][3] += wp;
            A[s][5] += wp;
            const V3 wa = {wp * a.x, wp * a.y, wp * a.z};
            B[s][1] += wa.z;
            B[s][2] -= wa.y;
            B[s][3] -= wa.z;
            B[s][5] += wa.x;
            B[s][6] += wa.y;
            B[s][7] -= wa.x;
            C[s][0] += wp * (ay2 + az2) + damped;
            C[s][1] -= wa.x * a.y;
            C[s][2] -= wa.x * a.z;
            C[s][3] += wp * (ax2 + az2) + damped;
            C[s][4] -= wa.y * a.z;
            C[s][5] += wp * (ax2 + ay2) + damped;
            const V3 torque = cross3(wa, r);
            g[s].x += wp * r.x;
            g[s].y += wp * r.y;
            g[s].z += wp * r.z;
            h[s].x += torque.x + wr * phi.x;
            h[s].y += torque.y + wr * phi.y;
            h[s].z += torque.z + wr * phi.z;

            // eliminate the bone's turn
            const Factor f = factor(C[s][0], C[s][1], C[s][2], C[s][3], C[s][4], C[s][5]);
            for (int j = 0; j < 3; ++j)
                X[s][j] = solve3(f, B[s][3 * j], B[s][3 * j + 1], B[s][3 * j + 2]);
            X[s][3] = solve3(f, h[s].x, h[s].y, h[s].z);
            VEC K[6];
            V3 k;
            int n = 0;
            for (int i = 0; i < 3; ++i)
                for (int j = i; j < 3; ++j, ++n)
                    K[n] = A[s][n] - DOT(B[s][3 * i], B[s][3 * i + 1], B[s][3 * i + 2], X[s][j].x, X[s][j].y, X[s][j].z);
            k.x = g[s].x - DOT(B[s][0], B[s][1], B[s][2], X[s][3].x, X[s][3].y, X[s][3].z);
            k.y = g[s].y - DOT(B[s][3], B[s][4], B[s][5], X[s][3].x, X[s][3].y, X[s][3].z);
            k.z = g[s].z - DOT(B[s][6], B[s][7], B[s][8], X[s][3].x, X[s][3].y, X[s][3].z);
            if (s == 0) {
                const Factor top = factor(K[0], K[1], K[2], K[3], K[4], K[5]);
                g[0] = solve3(top, k.x, k.y, k.z); // from here on g is how far each joint moves
                continue;
            }

            // hand it to the parent, through the bone between
            const int up = parent[s];
            const V3 o = bone[s];
            for (n = 0; n < 6; ++n)
                A[up][n] += K[n];
            const V3 row[3] = {{K[0], K[1], K[2]}, {K[1], K[3], K[4]}, {K[2], K[4], K[5]}};
            V3 W[3];
            for (int i = 0; i < 3; ++i) {
                W[i] = cross3(row[i], o);
                B[up][3 * i] -= W[i].x;
                B[up][3 * i + 1] -= W[i].y;
                B[up][3 * i + 2] -= W[i].z;
            }
            const V3 c0 = {W[0].x, W[1].x, W[2].x}, c1 = {W[0].y, W[1].y, W[2].y}, c2 = {W[0].z, W[1].z, W[2].z};
            const V3 t0 = cross3(c0, o), t1 = cross3(c1, o), t2 = cross3(c2, o);
            C[up][0] += t0.x;
            C[up][1] += t1.x;
            C[up][2] += t2.x;
            C[up][3] += t1.y;
            C[up][4] += t2.y;
            C[up][5] += t2.z;
            const V3 turn = cross3(o, k);
            g[up].x += k.x;
            g[up].y += k.y;
            g[up].z += k.z;
            h[up].x += turn.x;
            h[up].y += turn.y;
            h[up].z += turn.z;
        }
        for (int s = 0; s < S; ++s) {
            if (s > 0) {
                const V3 swung = cross3(h[parent[s]], bone[s]); // h is how far each bone turns, once its parent is done
                g[s].x = g[parent[s]].x + swung.x;
                g[s].y = g[parent[s]].y + swung.y;
                g[s].z = g[parent[s]].z + swung.z;
            }
            V3 t = X[s][3];
            t.x -= X[s][0].x * g[s].x + X[s][1].x * g[s].y + X[s][2].x * g[s].z;
            t.y -= X[s][0].y * g[s].x + X[s][1].y * g[s].y + X[s][2].y * g[s].z;
            t.z -= X[s][0].z * g[s].x + X[s][1].z * g[s].y + X[s][2].z * g[s].z;
            h[s] = t;
            const VEC x = t.x * (REAL)0.5, y = t.y * (REAL)0.5, z = t.z * (REAL)0.5;
            const VEC q0 = q[s][0] - x * q[s][1] - y * q[s][2] - z * q[s][3];
            const VEC q1 = q[s][1] + x * q[s][0] + y * q[s][3] - z * q[s][2];
            const VEC q2 = q[s][2] - x * q[s][3] + y * q[s][0] + z * q[s][1];
            const VEC q3 = q[s][3] + x * q[s][2] - y * q[s][1] + z * q[s][0];
            const VEC shorter = (REAL)1 / sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3);
            q[s][0] = q0 * shorter;
            q[s][1] = q1 * shorter;
            q[s][2] = q2 * shorter;
            q[s][3] = q3 * shorter;
        }
        p[0].x += g[0].x;
        p[0].y += g[0].y;
        p[0].z += g[0].z;
    }
    for (int s = 0; s < S; ++s) {
        if (s > 0) {
            __constant const REAL *b = body + 8 * s;
            const V3 o = carry(q[parent[s]], b[3], b[4], b[5]);
            p[s].x = p[parent[s]].x + o.x;
            p[s].y = p[parent[s]].y + o.y;
            p[s].z = p[parent[s]].z + o.z;
        }
        PUT(place, 3 * s) = p[s].x;
        PUT(place, 3 * s + 1) = p[s].y;
        PUT(place, 3 * s + 2) = p[s].z;
        for (int k = 0; k < 4; ++k)
            PUT(answer, 4 * s + k) = q[s][k];
    }
}
