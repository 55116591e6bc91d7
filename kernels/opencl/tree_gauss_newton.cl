// Gauss-Newton on the tree of a body, frame by frame.
// Twin of solve_tree in kernels/calibration/tree_solver.py; read after components.cl.
//
// Shapes, REAL, row first and frame last, frames padded to whole vectors by repeating the last:
//   position (3 S, stride)   sensors, from an origin of each frame's own
//   turned   (4 S, stride)   what the sensors say, wxyz, unit
//   weight   (S, stride)
//   body     (S, 11)         as body_rows of the twin writes it
//   place    (3 S, stride), answer (4 S, stride), output: origins and rotations of the bones
// One work-item owns LANES frames, and no frame sees another. Build options: REAL, LANES (as in components.cl), S (bones),
// PARENTS (their parents, a list).

#define ROW 11
#define AT(base, row) (*(__global const VEC *)((base) + (size_t)(row) * stride + frame))
#define PUT(base, row) (*(__global VEC *)((base) + (size_t)(row) * stride + frame))
#define VECTOR(base, s) {AT(base, 3 * (s)), AT(base, 3 * (s) + 1), AT(base, 3 * (s) + 2)}
#define QUATERNION(base, s) {AT(base, 4 * (s)), AT(base, 4 * (s) + 1), AT(base, 4 * (s) + 2), AT(base, 4 * (s) + 3)}

// what a bone and all below it want of its joint's movement dp and its turn dt: A dp + B dt = g, B^T dp + C dt = h;
// A and C their upper triangles row by row, B its rows
typedef struct { VEC A[6], C[6]; V3 B[3], g, h; } Equations;

// a bone's turn: of_pull - X dp; X by its columns
typedef struct { V3 X[3], of_pull; } Turn;

static void weigh(
    Equations *e, const V3 at, const Q4 said, const VEC belief, const Q4 q, const V3 place, __constant const REAL *row,
    const int is_first)
{
    const V3 arm = carry(q, row);
    const V3 r = subtract(subtract(at, place), arm);
    const V3 phi = rotation_between(q, said);
    VEC wp = belief * row[6], wr = belief * row[7];
    if (!is_first) {
        const VEC up = (REAL)1 + dot3(r, r) * row[9];
        const VEC ur = (REAL)1 + dot3(phi, phi) * row[10];
        wp = wp / (up * up);
        wr = wr / (ur * ur);
    }
    const V3 w = scale(wp, arm);
    const VEC damped = wr + row[8], zero = (VEC)((REAL)0);
    e->A[0] = e->A[3] = e->A[5] = wp;
    e->A[1] = e->A[2] = e->A[4] = zero;
    const V3 b0 = {zero, w.z, -w.y}, b1 = {-w.z, zero, w.x}, b2 = {w.y, -w.x, zero};
    e->B[0] = b0;
    e->B[1] = b1;
    e->B[2] = b2;
    e->C[0] = wp * (arm.y * arm.y + arm.z * arm.z) + damped;
    e->C[1] = -(w.x * arm.y);
    e->C[2] = -(w.x * arm.z);
    e->C[3] = wp * (arm.x * arm.x + arm.z * arm.z) + damped;
    e->C[4] = -(w.y * arm.z);
    e->C[5] = wp * (arm.x * arm.x + arm.y * arm.y) + damped;
    e->g = scale(wp, r);
    e->h = add(cross3(w, r), scale(wr, phi));
}

// solve for the bone's turn, and leave its joint's movement: K dp = k
static V3 eliminate(const Equations *e, Turn *way, VEC *K)
{
    const Factor f = factor(e->C);
    for (int j = 0; j < 3; ++j)
        way->X[j] = solve3(f, e->B[j]);
    const V3 x = way->of_pull = solve3(f, e->h);
    for (int i = 0, n = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j, ++n)
            K[n] = e->A[n] - dot3(e->B[i], way->X[j]);
    const V3 held = {dot3(e->B[0], x), dot3(e->B[1], x), dot3(e->B[2], x)};
    return subtract(e->g, held);
}

// add what a child wants, whose joint moves by dp + dt x bone
static void with_child(Equations *e, const VEC *K, const V3 k, const V3 bone)
{
    const V3 row[3] = {{K[0], K[1], K[2]}, {K[1], K[3], K[4]}, {K[2], K[4], K[5]}};
    V3 W[3];
    for (int i = 0; i < 3; ++i) {
        W[i] = cross3(row[i], bone);
        e->B[i] = subtract(e->B[i], W[i]);
    }
    const V3 c0 = {W[0].x, W[1].x, W[2].x}, c1 = {W[0].y, W[1].y, W[2].y}, c2 = {W[0].z, W[1].z, W[2].z};
    const V3 t0 = cross3(c0, bone), t1 = cross3(c1, bone), t2 = cross3(c2, bone);
    const VEC t[6] = {t0.x, t1.x, t2.x, t1.y, t2.y, t2.z};
    for (int n = 0; n < 6; ++n) {
        e->A[n] = e->A[n] + K[n];
        e->C[n] = e->C[n] + t[n];
    }
    e->g = add(e->g, k);
    e->h = add(e->h, cross3(bone, k));
}

static V3 turn_of(const Turn *way, const V3 moved)
{
    return subtract(
        way->of_pull,
        add(add(scale(moved.x, way->X[0]), scale(moved.y, way->X[1])), scale(moved.z, way->X[2])));
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
    Q4 q[S];
    V3 p[S], bone[S], moved[S], turns[S];
    Equations wanted[S];
    Turn way[S];

    for (int s = 0; s < S; ++s) {
        const Q4 said = QUATERNION(turned, s);
        q[s] = said;
    }
    const V3 root = VECTOR(position, 0);
    p[0] = root;
    for (int step = 0; step <= iterations; ++step) {
        for (int s = 1; s < S; ++s) {
            bone[s] = carry(q[parent[s]], body + ROW * s + 3);
            p[s] = add(p[parent[s]], bone[s]);
        }
        if (step == iterations)
            break;
        for (int s = 0; s < S; ++s) {
            const V3 at = VECTOR(position, s);
            const Q4 said = QUATERNION(turned, s);
            weigh(&wanted[s], at, said, AT(weight, s), q[s], p[s], body + ROW * s, step == 0);
        }
        for (int s = S - 1; s >= 0; --s) {
            VEC K[6];
            const V3 k = eliminate(&wanted[s], &way[s], K);
            if (s > 0)
                with_child(&wanted[parent[s]], K, k, bone[s]);
            else
                moved[0] = solve3(factor(K), k);
        }
        for (int s = 0; s < S; ++s) {
            if (s > 0)
                moved[s] = add(moved[parent[s]], cross3(turns[parent[s]], bone[s]));
            turns[s] = turn_of(&way[s], moved[s]);
            q[s] = turn(q[s], turns[s]);
        }
        p[0] = add(p[0], moved[0]);
    }
    for (int s = 0; s < S; ++s) {
        PUT(place, 3 * s) = p[s].x;
        PUT(place, 3 * s + 1) = p[s].y;
        PUT(place, 3 * s + 2) = p[s].z;
        PUT(answer, 4 * s) = q[s].w;
        PUT(answer, 4 * s + 1) = q[s].x;
        PUT(answer, 4 * s + 2) = q[s].y;
        PUT(answer, 4 * s + 3) = q[s].z;
    }
}
