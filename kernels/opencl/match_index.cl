// Tables of block sums of clips, from frames or from smaller blocks, and the largest of neighbours.
// See kernels/matching/blocks.py for the rows.
//
// A clip has clip_first[c] frames before it and is clip_stride[c] frames long with its zeros at the end (a multiple of
// 16, at least 8 more than its frames). Its table of R rows begins at R (clip_first[c] - origin), row after row.
// One work-item owns LANES columns of one row of one clip. Build option: LANES (4, 8 or 16).

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define VEC JOIN(float, LANES)
#define IVEC JOIN(int, LANES)
// a vector at any address: some drivers call vload out of line, at half the speed
typedef struct __attribute__((packed, aligned(4))) { VEC v; } Anywhere;
#define LOAD(pointer) (((__global const Anywhere *)(pointer))->v)
#define STORE(pointer, value) (((__global Anywhere *)(pointer))->v = (value))

// the row from n on, zeros beyond its end
static VEC part(__global const float *row, const int n, const int stride)
{
    if (n + LANES <= stride)
        return LOAD(row + n);
    union { VEC v; float lane[LANES]; } some;
    for (int i = 0; i < LANES; ++i)
        some.lane[i] = n + i < stride ? row[n + i] : 0.0f;
    return some.v;
}

// from frames: out[n] = sum over t of taps[row][t] frame[n + t]
__kernel void sum_frames(
    const int first_clip, const int n_clips, const int n_rows, const int n_taps, const int origin,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict frame,
    __global const float *restrict taps,
    __global float *restrict out)
{
    const int n = get_global_id(0) * LANES, row = get_global_id(1);
    const int clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip];
    if (n >= stride)
        return;
    __global const float *in = frame + clip_first[clip];
    VEC total = (VEC)(0.0f);
    for (int t = 0; t < n_taps; ++t)
        total += taps[row * n_taps + t] * part(in, n + t, stride);
    STORE(out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride + n, total);
}

// from smaller blocks: child is (row, shift) of each of n_children for every row
__kernel void sum_blocks(
    const int first_clip, const int n_clips, const int n_rows, const int n_small_rows, const int n_children,
    const int origin, const int small_origin,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict small,
    __global const int2 *restrict child,
    __global float *restrict out)
{
    const int n = get_global_id(0) * LANES, row = get_global_id(1);
    const int clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip];
    if (n >= stride)
        return;
    __global const float *in = small + (size_t)(clip_first[clip] - small_origin) * n_small_rows;
    VEC total = (VEC)(0.0f);
    for (int c = 0; c < n_children; ++c) {
        const int2 from = child[row * n_children + c];
        total += part(in + (size_t)from.x * stride, n + from.y, stride);
    }
    STORE(out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride + n, total);
}

// the largest of `fold` neighbours (1, 2, 4 or 8), sorted by n mod fold: out[n mod fold][n div fold] = max of
// in[n .. n + fold - 1]. One work-item owns 64 columns, LANES is not used.
__kernel void largest_of(
    const int first_clip, const int n_clips, const int n_rows, const int fold, const int origin, const int in_origin,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict in,
    __global float *restrict out)
{
    const int n = get_global_id(0) * 64, row = get_global_id(1);
    const int clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip];
    if (n >= stride)
        return;
    __global const float *from = in + (size_t)(clip_first[clip] - in_origin) * n_rows + (size_t)row * stride + n;
    __global float *to = out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride + n / fold;
    const int left = stride - n;
    float x[72];
    if (left >= 72)
        for (int i = 0; i < 72; ++i)
            x[i] = from[i];
    else
        for (int i = 0; i < 72; ++i)
            x[i] = i < left ? from[i] : 0.0f;
    for (int reach = 1; reach < fold; reach *= 2)
        for (int i = 0; i < 72 - reach; ++i)
            x[i] = x[i] > x[i + reach] ? x[i] : x[i + reach];
    const int columns = (left < 64 ? left : 64) / fold;
    for (int r = 0; r < fold; ++r)
        for (int i = 0; i < columns; ++i)
            to[r * (stride / fold) + i] = x[fold * i + r];
}
