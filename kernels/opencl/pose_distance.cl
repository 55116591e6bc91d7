// Distances of every row pose to every column pose.
// Twin of pose_distance in kernels/graph/distance.py.
//
// Shapes, float32, coordinate first and pose last, padded with zeros to whole blocks of poses:
//   row_linear     (n_linear, row_stride)           column_linear     (n_linear, column_stride)
//   row_quaternion (4 n_quaternion, row_stride)     column_quaternion (4 n_quaternion, column_stride)
//   weight         (n_quaternion)
//   distance       (row_stride, column_stride), output
// One work-item owns ROWS rows by LANES columns of the output. Build options: ROWS (a literal 8 or 4), LANES (4, 8, 16).
//
// Every step is a correctly rounded operation in a fixed order (add, sub, mul, smaller of two), nothing may be contracted
// or reordered, and no pair sees another: the bits of a distance do not depend on the tile, the lanes or the device.
// No built-in functions in the loops: some drivers call them out of line (with fma and vload, PoCL took twice as long).

#pragma OPENCL FP_CONTRACT OFF

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define VEC JOIN(float, LANES)
#define AT(base, index) (*(__global const VEC *)((base) + (index)))

__kernel void pose_distance(
    const int n_linear,
    const int n_quaternion,
    const int row_stride,
    const int column_stride,
    __global const float *restrict row_linear,
    __global const float *restrict column_linear,
    __global const float *restrict row_quaternion,
    __global const float *restrict column_quaternion,
    __global const float *restrict weight,
    __global float *restrict distance)
{
    const int column = get_global_id(0) * LANES;
    const int row = get_global_id(1) * ROWS;
    if (column >= column_stride || row >= row_stride)
        return;

    VEC total[ROWS];
    #pragma unroll
    for (int r = 0; r < ROWS; ++r)
        total[r] = (VEC)(0.0f);

    for (int d = 0; d < n_linear; ++d) {
        const VEC b = AT(column_linear, (size_t)d * column_stride + column);
        __global const float *a = row_linear + (size_t)d * row_stride + row;
        #pragma unroll
        for (int r = 0; r < ROWS; ++r) {
            const VEC apart = (VEC)(a[r]) - b;
            total[r] += apart * apart;
        }
    }

    for (int k = 0; k < n_quaternion; ++k) {
        const VEC w = (VEC)(weight[k]);
        const size_t first = (size_t)(4 * k);
        const VEC b0 = AT(column_quaternion, first * column_stride + column);
        const VEC b1 = AT(column_quaternion, (first + 1) * column_stride + column);
        const VEC b2 = AT(column_quaternion, (first + 2) * column_stride + column);
        const VEC b3 = AT(column_quaternion, (first + 3) * column_stride + column);
        __global const float *a = row_quaternion + first * row_stride + row;
        #pragma unroll
        for (int r = 0; r < ROWS; ++r) {
            const VEC a0 = (VEC)(a[r]), a1 = (VEC)(a[row_stride + r]);
            const VEC a2 = (VEC)(a[2 * row_stride + r]), a3 = (VEC)(a[3 * row_stride + r]);
            const VEC m0 = a0 - b0, m1 = a1 - b1, m2 = a2 - b2, m3 = a3 - b3;
            const VEC p0 = a0 + b0, p1 = a1 + b1, p2 = a2 + b2, p3 = a3 + b3;
            const VEC near = m0 * m0 + m1 * m1 + m2 * m2 + m3 * m3;
            const VEC far = p0 * p0 + p1 * p1 + p2 * p2 + p3 * p3;
            // square of the angle from s, the square of the chord, 0 <= s <= 2: (4 arcsin(sqrt(s) / 2))^2 = s p(s), p the
            // Chebyshev interpolant of degree 8 on [0, 2]; relative error below 1e-7
            const VEC s = near < far ? near : far;
            VEC p = (VEC)(2.2240253505694346e-05f);
            p = p * s + -9.829114822091818e-05f;
            p = p * s + 0.00030732739207576533f;
            p = p * s + -9.881407461421153e-05f;
            p = p * s + 0.0015207641879166531f;
            p = p * s + 0.007040986994323247f;
            p = p * s + 0.04446482932825441f;
            p = p * s + 0.3333317828000964f;
            p = p * s + 4.000000019195267f;
            total[r] += w * (p * s);
        }
    }

    #pragma unroll
    for (int r = 0; r < ROWS; ++r)
        *(__global VEC *)(distance + (size_t)(row + r) * column_stride + column) = total[r];
}
