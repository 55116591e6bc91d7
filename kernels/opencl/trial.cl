// A trial of a device: what the other kernels use, on numbers whose answers are known.
// Twin of expected in kernels/opencl/trial.py.
//
// Shapes, float32: a, b (n), n a multiple of 4; sum, fused, root (n), output; count (1) int32, zero; most (1) int32, zero.
// One work-item owns four numbers, as one vector.

__kernel void trial(
    const int n,
    __global const float *restrict a,
    __global const float *restrict b,
    __constant float *weight,
    __global float *restrict sum,
    __global float *restrict fused,
    __global float *restrict root,
    __global int *count,
    __global int *most)
{
    const int first = 4 * (int)get_global_id(0);
    if (first >= n)
        return;
    const float4 x = *(__global const float4 *)(a + first);
    const float4 y = *(__global const float4 *)(b + first);
    float4 total = (float4)(0.0f);
    for (int k = 0; k < 4; ++k)
        total += (float4)(weight[k]) * (x + y) * x / (x + y + (float4)(1.0f));
    *(__global float4 *)(sum + first) = total;
    *(__global float4 *)(fused + first) = fma(x, y, -(x * x));
    for (int i = first; i < min(first + 4, n); ++i) {
        root[i] = sqrt(a[i] < b[i] ? a[i] : b[i]);
        if (a[i] < b[i])
            atomic_inc(count);
        atomic_max(most, as_int(a[i]));
    }
}
