// Vectors, rotations and symmetric 3 x 3 equations by their components, each sum and product in the order written.
// Twin of kernels/calibration/components.py; read before a kernel's own file.
//
// Build options: REAL (float or double), LANES (1, 2, 4, 8 or 16: how many frames a VEC holds).
//
// Plain arithmetic, divisions and square roots, never contracted: double precision has the reference's bits.

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

typedef struct { VEC x, y, z; } V3;
typedef struct { VEC w, x, y, z; } Q4;
typedef struct { VEC d0, d1, d2, l10, l20, l21; } Factor;

static V3 add(const V3 a, const V3 b)
{
    const V3 sum = {a.x + b.x, a.y + b.y, a.z + b.z};
    return sum;
}

static V3 subtract(const V3 a, const V3 b)
{
    const V3 difference = {a.x - b.x, a.y - b.y, a.z - b.z};
    return difference;
}

static V3 scale(const VEC k, const V3 v)
{
    const V3 multiple = {k * v.x, k * v.y, k * v.z};
    return multiple;
}

static VEC dot3(const V3 a, const V3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static V3 cross3(const V3 a, const V3 b)
{
    const V3 product = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return product;
}

// a constant vector turned: v + w t + u x t with t = 2 u x v, where q = (w, u)
static V3 carry(const Q4 q, __constant const REAL *v)
{
    const REAL a = v[0], b = v[1], c = v[2];
    const VEC tx = (REAL)2 * (q.y * c - q.z * b);
    const VEC ty = (REAL)2 * (q.z * a - q.x * c);
    const VEC tz = (REAL)2 * (q.x * b - q.y * a);
    const V3 carried = {
        a + q.w * tx + (q.y * tz - q.z * ty),
        b + q.w * ty + (q.z * tx - q.x * tz),
        c + q.w * tz + (q.x * ty - q.y * tx)};
    return carried;
}

// the left product with (1, t / 2), brought to length one
static Q4 turn(const Q4 q, const V3 t)
{
    const V3 half_ = scale((VEC)((REAL)0.5), t);
    const VEC e = q.w - half_.x * q.x - half_.y * q.y - half_.z * q.z;
    const VEC f = q.x + half_.x * q.w + half_.y * q.z - half_.z * q.y;
    const VEC g = q.y - half_.x * q.z + half_.y * q.w + half_.z * q.x;
    const VEC h = q.z + half_.x * q.y - half_.y * q.x + half_.z * q.w;
    const VEC length_ = sqrt(e * e + f * f + g * g + h * h);
    const Q4 turned = {e / length_, f / length_, g / length_, h / length_};
    return turned;
}

// twice the vector part of other q^-1, lengthened by the series of the arcsine
static V3 rotation_between(const Q4 q, const Q4 other)
{
    const VEC w = other.w * q.w + other.x * q.x + other.y * q.y + other.z * q.z;
    const VEC two = w < (VEC)((REAL)0) ? (VEC)((REAL)-2) : (VEC)((REAL)2);
    const V3 v = {
        two * (other.x * q.w - other.w * q.x + other.z * q.y - other.y * q.z),
        two * (other.y * q.w - other.w * q.y + other.x * q.z - other.z * q.x),
        two * (other.z * q.w - other.w * q.z + other.y * q.x - other.x * q.y)};
    const VEC square = (REAL)0.25 * dot3(v, v);
    return scale(
        (REAL)1 + square * ((REAL)(1.0 / 6.0) + square * ((REAL)(3.0 / 40.0) + square * (REAL)(15.0 / 336.0))), v);
}

// a symmetric positive matrix as L D L^T, the diagonal inverted; c is its upper triangle, row by row
static Factor factor(const VEC *c)
{
    Factor f;
    f.d0 = (REAL)1 / c[0];
    f.l10 = c[1] * f.d0;
    f.l20 = c[2] * f.d0;
    f.d1 = (REAL)1 / (c[3] - f.l10 * c[1]);
    const VEC rest = c[4] - f.l20 * c[1];
    f.l21 = rest * f.d1;
    f.d2 = (REAL)1 / (c[5] - f.l20 * c[2] - f.l21 * rest);
    return f;
}

static V3 solve3(const Factor f, const V3 b)
{
    const VEC y1 = b.y - f.l10 * b.x;
    const VEC y2 = b.z - f.l20 * b.x - f.l21 * y1;
    V3 v;
    v.z = y2 * f.d2;
    v.y = y1 * f.d1 - f.l21 * v.z;
    v.x = b.x * f.d0 - f.l10 * v.y - f.l20 * v.z;
    return v;
}
