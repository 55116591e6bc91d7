// Tables of block sums of clips, from frames or from smaller blocks, and the largest of neighbours.
// See kernels/matching/blocks.py for the rows.
//
// A clip has clip_first[c] frames before it and is clip_stride[c] frames long with its zeros at the end (a multiple of
// 16, at least 8 more than its frames). Its table of R rows begins at R (clip_first[c] - origin), row after row.
// One work-item owns `span` columns of one row of one clip, a multiple of LANES: all of them on a CPU, where long runs
// through memory are best. Build option: LANES (4, 8 or 16).

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
    const int first_clip, const int n_clips, const int n_rows, const int n_taps, const int origin, const int span,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict frame,
    __global const float *restrict taps,
    __global float *restrict out)
{
    const int row = get_global_id(1), clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip], begin = get_global_id(0) * span;
    const int end = min(begin + span, stride);
    __global const float *in = frame + clip_first[clip];
    __global const float *weight = taps + row * n_taps;
    __global float *to = out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride;
    int n = begin;
    for (; n + 2 * LANES <= end && n + 2 * LANES + n_taps <= stride; n += 2 * LANES) {
        VEC one = (VEC)(0.0f), two = (VEC)(0.0f);
        for (int t = 0; t < n_taps; ++t) {
            one += weight[t] * LOAD(in + n + t);
            two += weight[t] * LOAD(in + n + t + LANES);
        }
        STORE(to + n, one);
        STORE(to + n + LANES, two);
    }
    for (; n < end; n += LANES) {
        VEC total = (VEC)(0.0f);
        for (int t = 0; t < n_taps; ++t)
            total += weight[t] * part(in, n + t, stride);
        STORE(to + n, total);
    }
}

// from smaller blocks: child is (row, shift) of each of n_children for every row
__kernel void sum_blocks(
    const int first_clip, const int n_clips, const int n_rows, const int n_small_rows, const int n_children,
    const int origin, const int small_origin, const int span,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict small,
    __global const int2 *restrict child,
    __global float *restrict out)
{
    const int row = get_global_id(1), clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip], begin = get_global_id(0) * span;
    const int end = min(begin + span, stride);
    __global const float *in = small + (size_t)(clip_first[clip] - small_origin) * n_small_rows;
    __global const int2 *from = child + row * n_children;
    __global float *to = out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride;
    const int reach = from[n_children - 1].y;
    int n = begin;
    for (; n + 2 * LANES <= end && n + 2 * LANES + reach <= stride; n += 2 * LANES) {
        VEC one = (VEC)(0.0f), two = (VEC)(0.0f);
        for (int c = 0; c < n_children; ++c) {
            __global const float *some = in + (size_t)from[c].x * stride + from[c].y + n;
            one += LOAD(some);
            two += LOAD(some + LANES);
        }
        STORE(to + n, one);
        STORE(to + n + LANES, two);
    }
    for (; n < end; n += LANES) {
        VEC total = (VEC)(0.0f);
        for (int c = 0; c < n_children; ++c)
            total += part(in + (size_t)from[c].x * stride, n + from[c].y, stride);
        STORE(to + n, total);
    }
}

typedef struct __attribute__((packed, aligned(4))) { float8 v; } Eight;
#define LOAD8(pointer) (((__global const Eight *)(pointer))->v)
#define STORE8(pointer, value) (((__global Eight *)(pointer))->v = (value))

static float8 larger(const float8 a, const float8 b)
{
    return a > b ? a : b;
}

// the largest of 1, 2, 4 or 8 neighbours from each of 8 places
static float8 largest_from(__global const float *x, const int fold)
{
    float8 top = LOAD8(x);
    if (fold > 1)
        top = larger(top, LOAD8(x + 1));
    if (fold > 2)
        top = larger(top, larger(LOAD8(x + 2), LOAD8(x + 3)));
    if (fold > 4)
        top = larger(top, larger(larger(LOAD8(x + 4), LOAD8(x + 5)), larger(LOAD8(x + 6), LOAD8(x + 7))));
    return top;
}

// the largest of `fold` neighbours (1, 2, 4 or 8), sorted by n mod fold: out[n mod fold][n div fold] = max of
// in[n .. n + fold - 1], zeros beyond the row's end. `span` is a multiple of 64.
__kernel void largest_of(
    const int first_clip, const int n_clips, const int n_rows, const int fold, const int origin, const int in_origin,
    const int span,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const float *restrict in,
    __global float *restrict out)
{
    const int row = get_global_id(1), clip = first_clip + get_global_id(2);
    if (row >= n_rows || clip >= first_clip + n_clips)
        return;
    const int stride = clip_stride[clip], begin = get_global_id(0) * span, columns = stride / fold;
    const int end = min(begin + span, stride);
    __global const float *from = in + (size_t)(clip_first[clip] - in_origin) * n_rows + (size_t)row * stride;
    __global float *to = out + (size_t)(clip_first[clip] - origin) * n_rows + (size_t)row * stride;
    int n = begin;
    if (fold == 8)
        for (; n + 64 <= end && n + 72 <= stride; n += 64) {
            // eight runs of eight: thrice the even and the odd ones apart sorts them by n mod 8
            float8 x[8];
            #pragma unroll
            for (int i = 0; i < 8; ++i)
                x[i] = largest_from(from + n + 8 * i, 8);
            #pragma unroll
            for (int turn = 0; turn < 3; ++turn) {
                float8 y[8];
                #pragma unroll
                for (int i = 0; i < 4; ++i) {
                    y[i] = (float8)(x[2 * i].even, x[2 * i + 1].even);
                    y[i + 4] = (float8)(x[2 * i].odd, x[2 * i + 1].odd);
                }
                #pragma unroll
                for (int i = 0; i < 8; ++i)
                    x[i] = y[i];
            }
            // now x[i] holds n mod 8 = i
            #pragma unroll
            for (int i = 0; i < 8; ++i)
                STORE8(to + i * columns + n / 8, x[i]);
        }
    else
        for (; n + 8 <= end && n + 16 <= stride; n += 8) {
            union { float8 v; float lane[8]; } x;
            x.v = largest_from(from + n, fold);
            #pragma unroll
            for (int i = 0; i < 8; ++i)
                to[((n + i) % fold) * columns + (n + i) / fold] = x.lane[i];
        }
    for (; n < end; ++n) {
        float top = 0.0f;
        for (int i = n; i < min(n + fold, stride); ++i)
            top = from[i] > top ? from[i] : top;
        to[(n % fold) * columns + n / fold] = top;
    }
}
