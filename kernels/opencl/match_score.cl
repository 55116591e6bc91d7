// Scores and bounds of candidates, for all pairs of segments and clips. Reference: kernels/matching/score.py; the bounds
// and lists: kernels/matching/blocks.py. Shared definitions of match_refine.cl come first.
//
// C = sum a - sum a^2 / (a + b), four terms to a division (one to a division with -D SAFE, for features whose largest
// values differ by more than a thousand). No product of four can leave the range of float, see docs/matching.md.
// Every operand is positive, so all errors are relative and the host's margin covers any order and contraction.
//
// Clips are laid out as in match_index.cl. A group is `fold` neighbouring starts, f0 = fold i .. fold i + fold - 1; a
// place is scale * 2^SCALE_BITS + group (a start where fold is 1). Build options: LANES (4, 8, 16), WIDTH (segments a
// work-item takes together), SCALE_BITS, SCALE_DENOMINATOR (scales are numerator / SCALE_DENOMINATOR).

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define VEC JOIN(float, LANES)
#define IVEC JOIN(int, LANES)
typedef struct __attribute__((packed, aligned(4))) { VEC v; } Anywhere;
typedef struct __attribute__((packed, aligned(4))) { float8 v; } Anywhere8;
#define LOAD(pointer) (((__global const Anywhere *)(pointer))->v)
#define LOAD8(pointer) (((__global const Anywhere8 *)(pointer))->v)
#define FAR 3.0e38f
// some drivers call min out of line, which costs every vector register
#define SMALLER(a, b) ((a) < (b) ? (a) : (b))

#ifdef SAFE
#define ADD_TERMS(sum, b0, b1, b2, b3, a0, a1, a2, a3, s0, s1, s2, s3) \
    sum += s0 / (b0 + a0) + s1 / (b1 + a1) + (s2 / (b2 + a2) + s3 / (b3 + a3))
#else
#define ADD_TERMS(sum, b0, b1, b2, b3, a0, a1, a2, a3, s0, s1, s2, s3) \
    do { \
        const __typeof__(sum) d0 = b0 + a0, d1 = b1 + a1, d2 = b2 + a2, d3 = b3 + a3; \
        const __typeof__(sum) q0 = d0 * d1, q1 = d2 * d3; \
        sum += ((s0 * d1 + s1 * d0) * q1 + (s2 * d3 + s3 * d2) * q0) / (q0 * q1); \
    } while (0)
#endif

static int count_starts(const int n_frames, const int n_segment, const int numerator)
{
    const int last = (numerator * (n_segment - 1) + SCALE_DENOMINATOR - 1) / SCALE_DENOMINATOR;
    return n_frames > last ? n_frames - last : 0;
}

// The largest bound (or score) of each pair of segment and clip, and where: WIDTH segments of like length, all blocks.
//   step     (n_scales, n_blocks): of a block, row * fold + shift mod fold, and shift div fold
//   table    rows of the clips, the largest of `fold` neighbouring starts (1, 2, 4 or 8)
//   amount   (bundle, n_blocks, 2, WIDTH)
//   largest  (n_segments, n_clips), -1 where no start fits; place beside it
// One work-item owns one clip and WIDTH segments; neighbours take the same clip, whose rows stay in the cache.
__kernel void bound_together(
    const int n_clips, const int n_segments, const int n_scales, const int n_blocks, const int n_rows, const int fold,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const int *restrict clip_frames,
    __global const int *restrict numerator,
    __global const int2 *restrict step,
    __global const float *restrict table,
    __global const float *restrict amount,
    __global const float *restrict music_sum,
    __global const int *restrict segment_frames,
    __global float *restrict largest,
    __global int *restrict place)
{
    const int bundle = get_global_id(0), clip = get_global_id(1);
    if (clip >= n_clips || bundle * WIDTH >= n_segments)
        return;
    const int columns = clip_stride[clip] / fold;
    __global const float *rows = table + (size_t)clip_first[clip] * n_rows;
    __global const float *a = amount + (size_t)bundle * n_blocks * 2 * WIDTH;
    union { IVEC v; int lane[LANES]; } lanes;
    for (int i = 0; i < LANES; ++i)
        lanes.lane[i] = i;
    VEC least[WIDTH];
    IVEC at[WIDTH];
    int shortest = segment_frames[bundle * WIDTH], frames[WIDTH];
    for (int s = 0; s < WIDTH; ++s) {
        least[s] = (VEC)(FAR);
        at[s] = (IVEC)(-1);
        const int segment = bundle * WIDTH + s < n_segments ? bundle * WIDTH + s : n_segments - 1;
        frames[s] = segment_frames[segment];
        shortest = frames[s] < shortest ? frames[s] : shortest;
    }
    for (int p = 0; p < n_scales; ++p) {
        const int n_most = (count_starts(clip_frames[clip], shortest, numerator[p]) + fold - 1) / fold;
        int n[WIDTH];
        for (int s = 0; s < WIDTH; ++s)
            n[s] = (count_starts(clip_frames[clip], frames[s], numerator[p]) + fold - 1) / fold;
        __global const int2 *steps = step + p * n_blocks;
        for (int i = 0; i < n_most; i += LANES) {
            VEC sum[WIDTH];
            #pragma unroll
            for (int s = 0; s < WIDTH; ++s)
                sum[s] = (VEC)(0.0f);
            for (int k = 0; k < n_blocks; k += 4) {
                const int2 k0 = steps[k], k1 = steps[k + 1], k2 = steps[k + 2], k3 = steps[k + 3];
                // a block past the end of a shorter segment may lie outside the clip: read anything, it adds nothing
                const VEC b0 = LOAD(rows + (size_t)k0.x * columns + SMALLER(k0.y, columns) + i);
                const VEC b1 = LOAD(rows + (size_t)k1.x * columns + SMALLER(k1.y, columns) + i);
                const VEC b2 = LOAD(rows + (size_t)k2.x * columns + SMALLER(k2.y, columns) + i);
                const VEC b3 = LOAD(rows + (size_t)k3.x * columns + SMALLER(k3.y, columns) + i);
                __global const float *ak = a + k * 2 * WIDTH;
                #pragma unroll
                for (int s = 0; s < WIDTH; ++s)
                    ADD_TERMS(sum[s], b0, b1, b2, b3,
                        ak[s], ak[2 * WIDTH + s], ak[4 * WIDTH + s], ak[6 * WIDTH + s],
                        ak[WIDTH + s], ak[3 * WIDTH + s], ak[5 * WIDTH + s], ak[7 * WIDTH + s]);
            }
            const IVEC here = lanes.v + (IVEC)((p << SCALE_BITS) + i);
            #pragma unroll
            for (int s = 0; s < WIDTH; ++s) {
                IVEC better = sum[s] < least[s];
                if (i + LANES > n[s])
                    better &= lanes.v < (IVEC)(n[s] - i);
                least[s] = better ? sum[s] : least[s];
                at[s] = better ? here : at[s];
            }
        }
    }
    for (int s = 0; s < WIDTH; ++s) {
        const int segment = bundle * WIDTH + s;
        if (segment >= n_segments)
            return;
        union { VEC v; float lane[LANES]; } low;
        union { IVEC v; int lane[LANES]; } where;
        low.v = least[s];
        where.v = at[s];
        int best = 0;
        for (int i = 1; i < LANES; ++i)
            best = low.lane[i] < low.lane[best] ? i : best;
        const float value = music_sum[segment] - low.lane[best];
        largest[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? -1.0f : value > 0.0f ? value : 0.0f;
        place[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? 0 : where.lane[best];
    }
}

// As bound_together with `fold` = 1 and blocks of one frame, the frames interpolated here: the tuned search of everything.
//   step (n_scales, n_blocks): shift of a frame; weight of the next one beside it
__kernel void score_together(
    const int n_clips, const int n_segments, const int n_scales, const int n_blocks,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const int *restrict clip_frames,
    __global const int *restrict numerator,
    __global const int *restrict step,
    __global const float *restrict weight,
    __global const float *restrict frame,
    __global const float *restrict amount,
    __global const float *restrict music_sum,
    __global const int *restrict segment_frames,
    __global float *restrict largest,
    __global int *restrict place)
{
    const int bundle = get_global_id(0), clip = get_global_id(1);
    if (clip >= n_clips || bundle * WIDTH >= n_segments)
        return;
    __global const float *in = frame + clip_first[clip];
    const int stride = clip_stride[clip];
    __global const float *a = amount + (size_t)bundle * n_blocks * 2 * WIDTH;
    union { IVEC v; int lane[LANES]; } lanes;
    for (int i = 0; i < LANES; ++i)
        lanes.lane[i] = i;
    VEC least[WIDTH];
    IVEC at[WIDTH];
    int shortest = segment_frames[bundle * WIDTH], frames[WIDTH];
    for (int s = 0; s < WIDTH; ++s) {
        least[s] = (VEC)(FAR);
        at[s] = (IVEC)(-1);
        const int segment = bundle * WIDTH + s < n_segments ? bundle * WIDTH + s : n_segments - 1;
        frames[s] = segment_frames[segment];
        shortest = frames[s] < shortest ? frames[s] : shortest;
    }
    for (int p = 0; p < n_scales; ++p) {
        const int n_most = count_starts(clip_frames[clip], shortest, numerator[p]);
        int n[WIDTH];
        for (int s = 0; s < WIDTH; ++s)
            n[s] = count_starts(clip_frames[clip], frames[s], numerator[p]);
        __global const int *steps = step + p * n_blocks;
        __global const float *weights = weight + p * n_blocks;
        for (int i = 0; i < n_most; i += LANES) {
            VEC sum[WIDTH];
            #pragma unroll
            for (int s = 0; s < WIDTH; ++s)
                sum[s] = (VEC)(0.0f);
            for (int k = 0; k < n_blocks; k += 4) {
                VEC b[4];
                #pragma unroll
                for (int j = 0; j < 4; ++j) {
                    __global const float *at_frame = in + SMALLER(steps[k + j], stride) + i;
                    const float w = weights[k + j];
                    b[j] = (1.0f - w) * LOAD(at_frame) + w * LOAD(at_frame + 1);
                }
                __global const float *ak = a + k * 2 * WIDTH;
                #pragma unroll
                for (int s = 0; s < WIDTH; ++s)
                    ADD_TERMS(sum[s], b[0], b[1], b[2], b[3],
                        ak[s], ak[2 * WIDTH + s], ak[4 * WIDTH + s], ak[6 * WIDTH + s],
                        ak[WIDTH + s], ak[3 * WIDTH + s], ak[5 * WIDTH + s], ak[7 * WIDTH + s]);
            }
            const IVEC here = lanes.v + (IVEC)((p << SCALE_BITS) + i);
            #pragma unroll
            for (int s = 0; s < WIDTH; ++s) {
                IVEC better = sum[s] < least[s];
                if (i + LANES > n[s])
                    better &= lanes.v < (IVEC)(n[s] - i);
                least[s] = better ? sum[s] : least[s];
                at[s] = better ? here : at[s];
            }
        }
    }
    for (int s = 0; s < WIDTH; ++s) {
        const int segment = bundle * WIDTH + s;
        if (segment >= n_segments)
            return;
        union { VEC v; float lane[LANES]; } low;
        union { IVEC v; int lane[LANES]; } where;
        low.v = least[s];
        where.v = at[s];
        int best = 0;
        for (int i = 1; i < LANES; ++i)
            best = low.lane[i] < low.lane[best] ? i : best;
        const float value = music_sum[segment] - low.lane[best];
        largest[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? -1.0f : value > 0.0f ? value : 0.0f;
        place[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? 0 : where.lane[best];
    }
}

// As bound_together for one segment a work-item, over the blocks with music only.
//   first (n_segments + 1), block (B), amount (B): the segments' lists; step as above, its rows n_steps blocks long
__kernel void bound_alone(
    const int n_clips, const int n_segments, const int n_scales, const int n_steps, const int n_rows, const int fold,
    __global const int *restrict clip_first,
    __global const int *restrict clip_stride,
    __global const int *restrict clip_frames,
    __global const int *restrict numerator,
    __global const int2 *restrict step,
    __global const float *restrict table,
    __global const int *restrict first,
    __global const int *restrict block,
    __global const float2 *restrict amount,
    __global const float *restrict music_sum,
    __global const int *restrict segment_frames,
    __global float *restrict largest,
    __global int *restrict place)
{
    const int segment = get_global_id(0), clip = get_global_id(1);
    if (clip >= n_clips || segment >= n_segments)
        return;
    const int columns = clip_stride[clip] / fold;
    __global const float *rows = table + (size_t)clip_first[clip] * n_rows;
    union { IVEC v; int lane[LANES]; } lanes;
    for (int i = 0; i < LANES; ++i)
        lanes.lane[i] = i;
    VEC least = (VEC)(FAR);
    IVEC at = (IVEC)(-1);
    for (int p = 0; p < n_scales; ++p) {
        const int n = (count_starts(clip_frames[clip], segment_frames[segment], numerator[p]) + fold - 1) / fold;
        __global const int2 *steps = step + p * n_steps;
        for (int i = 0; i < n; i += LANES) {
            VEC sum = (VEC)(0.0f);
            for (int j = first[segment]; j < first[segment + 1]; j += 4) {
                const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]];
                const int2 k2 = steps[block[j + 2]], k3 = steps[block[j + 3]];
                const VEC b0 = LOAD(rows + (size_t)k0.x * columns + k0.y + i);
                const VEC b1 = LOAD(rows + (size_t)k1.x * columns + k1.y + i);
                const VEC b2 = LOAD(rows + (size_t)k2.x * columns + k2.y + i);
                const VEC b3 = LOAD(rows + (size_t)k3.x * columns + k3.y + i);
                const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3];
                ADD_TERMS(sum, b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y);
            }
            const IVEC better = (sum < least) & (lanes.v + i < (IVEC)(n));
            least = better ? sum : least;
            at = better ? lanes.v + (IVEC)((p << SCALE_BITS) + i) : at;
        }
    }
    union { VEC v; float lane[LANES]; } low;
    union { IVEC v; int lane[LANES]; } where;
    low.v = least;
    where.v = at;
    int best = 0;
    for (int i = 1; i < LANES; ++i)
        best = low.lane[i] < low.lane[best] ? i : best;
    const float value = music_sum[segment] - low.lane[best];
    largest[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? -1.0f : value > 0.0f ? value : 0.0f;
    place[(size_t)segment * n_clips + clip] = where.lane[best] < 0 ? 0 : where.lane[best];
}
