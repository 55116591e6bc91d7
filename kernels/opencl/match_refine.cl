// From bounds of groups of starts to scores of starts, for chosen pairs of segments and clips. Follows match_score.cl
// in one program and shares its definitions.
//
// Two ways to the same answers. Depth first: one work-item owns a pair and goes from bound to bound to score in each
// group; the best score so far prunes what follows. Level by level, for devices whose work-items run in step: every level
// writes the groups that pass it for the next.
//
// Lists of the segments' blocks, one after another for the levels (0 the first bound, then the finer ones, last the
// frames): first[level * (n_segments + 1) + segment], block, amount; steps of a level begin at level_step[level] and are
// level_long[level] a scale. The first level's steps are folded, the frames' are the shift alone, with a weight.

// The sums of 8 starts each of `n` groups over a list, by a table's rows: steps and amounts are read once for all of them.
// from: where the groups begin, in a row.
#define SUMS_OF(n) \
static void JOIN(sums_of_, n)( \
    __global const float *rows, const int *from, const size_t stride, __global const int2 *steps, \
    __global const int *first, __global const int *block, __global const float2 *amount, float8 *out) \
{ \
    float8 sum[n]; \
    __global const float *at[n]; \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) { \
        sum[g] = (float8)(0.0f); \
        at[g] = rows + from[g]; \
    } \
    for (int j = first[0]; j < first[1]; j += 4) { \
        const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]], k2 = steps[block[j + 2]], k3 = steps[block[j + 3]]; \
        const size_t o0 = k0.x * stride + k0.y, o1 = k1.x * stride + k1.y; \
        const size_t o2 = k2.x * stride + k2.y, o3 = k3.x * stride + k3.y; \
        const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3]; \
        _Pragma("unroll") \
        for (int g = 0; g < n; ++g) { \
            const float8 b0 = LOAD8(at[g] + o0), b1 = LOAD8(at[g] + o1), b2 = LOAD8(at[g] + o2), b3 = LOAD8(at[g] + o3); \
            ADD_TERMS(sum[g], b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y); \
        } \
    } \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) \
        out[g] = sum[g]; \
}
SUMS_OF(1)
SUMS_OF(2)
SUMS_OF(4)

// the same over the frames, interpolated here
#define EXACT_OF(n) \
static void JOIN(exact_of_, n)( \
    __global const float *in, const int *from, __global const int2 *steps, __global const float *weights, \
    __global const int *first, __global const int *block, __global const float2 *amount, float8 *out) \
{ \
    float8 sum[n]; \
    __global const float *at[n]; \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) { \
        sum[g] = (float8)(0.0f); \
        at[g] = in + from[g]; \
    } \
    for (int j = first[0]; j < first[1]; j += 4) { \
        const int f0 = block[j], f1 = block[j + 1], f2 = block[j + 2], f3 = block[j + 3]; \
        const int o0 = steps[f0].y, o1 = steps[f1].y, o2 = steps[f2].y, o3 = steps[f3].y; \
        const float w0 = weights[f0], w1 = weights[f1], w2 = weights[f2], w3 = weights[f3]; \
        const float v0 = 1.0f - w0, v1 = 1.0f - w1, v2 = 1.0f - w2, v3 = 1.0f - w3; \
        const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3]; \
        _Pragma("unroll") \
        for (int g = 0; g < n; ++g) { \
            const float8 b0 = v0 * LOAD8(at[g] + o0) + w0 * LOAD8(at[g] + o0 + 1); \
            const float8 b1 = v1 * LOAD8(at[g] + o1) + w1 * LOAD8(at[g] + o1 + 1); \
            const float8 b2 = v2 * LOAD8(at[g] + o2) + w2 * LOAD8(at[g] + o2 + 1); \
            const float8 b3 = v3 * LOAD8(at[g] + o3) + w3 * LOAD8(at[g] + o3 + 1); \
            ADD_TERMS(sum[g], b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y); \
        } \
    } \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) \
        out[g] = sum[g]; \
}
EXACT_OF(1)
EXACT_OF(2)
EXACT_OF(4)

// for one group
static float8 sum_of_8(
    __global const float *rows, const size_t stride, __global const int2 *steps,
    __global const int *first, __global const int *block, __global const float2 *amount)
{
    const int from = 0;
    float8 sum;
    sums_of_1(rows, &from, stride, steps, first, block, amount, &sum);
    return sum;
}

static float8 exact_of_8(
    __global const float *in, __global const int2 *steps, __global const float *weights,
    __global const int *first, __global const int *block, __global const float2 *amount)
{
    const int from = 0;
    float8 sum;
    exact_of_1(in, &from, steps, weights, first, block, amount, &sum);
    return sum;
}

// the smallest of the first n of 8
static float least_of_8(const float8 sum, const int n)
{
    const int8 lane = (int8)(0, 1, 2, 3, 4, 5, 6, 7);
    const float8 some = lane < (int8)(n) ? sum : (float8)(FAR);
    const float4 four = some.lo < some.hi ? some.lo : some.hi;
    const float2 two = four.lo < four.hi ? four.lo : four.hi;
    return two.x < two.y ? two.x : two.y;
}

// the bounds of `n` times LANES groups from a folded table, one segment's list
#define BOUNDS_OF(n) \
static void JOIN(bounds_of_, n)( \
    __global const float *rows, const size_t columns, __global const int2 *steps, \
    __global const int *first, __global const int *block, __global const float2 *amount, VEC *out) \
{ \
    VEC sum[n]; \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) \
        sum[g] = (VEC)(0.0f); \
    for (int j = first[0]; j < first[1]; j += 4) { \
        const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]], k2 = steps[block[j + 2]], k3 = steps[block[j + 3]]; \
        __global const float *r0 = rows + (k0.x * columns + k0.y), *r1 = rows + (k1.x * columns + k1.y); \
        __global const float *r2 = rows + (k2.x * columns + k2.y), *r3 = rows + (k3.x * columns + k3.y); \
        const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3]; \
        _Pragma("unroll") \
        for (int g = 0; g < n; ++g) { \
            const VEC b0 = LOAD(r0 + g * LANES), b1 = LOAD(r1 + g * LANES); \
            const VEC b2 = LOAD(r2 + g * LANES), b3 = LOAD(r3 + g * LANES); \
            ADD_TERMS(sum[g], b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y); \
        } \
    } \
    _Pragma("unroll") \
    for (int g = 0; g < n; ++g) \
        out[g] = sum[g]; \
}
BOUNDS_OF(1)
BOUNDS_OF(2)

#define CLIPS \
    __global const int *restrict clip_first, __global const int *restrict clip_stride, \
    __global const int *restrict clip_frames, __global const float *restrict frame
#define SEGMENTS \
    const int n_segments, __global const float *restrict music_sum, __global const float *restrict margin, \
    __global const int *restrict segment_frames, __global const int *restrict first, \
    __global const int *restrict block, __global const float2 *restrict amount
#define STEPS \
    const int n_scales, __global const int *restrict numerator, __global const int2 *restrict step, \
    __global const float *restrict weight, __global const int *restrict level_step, \
    __global const int *restrict level_long
#define TABLES \
    const int n_bounds, const int fold, const int fold_rows, __global const float *restrict folded, \
    const int rows_1, __global const float *restrict table_1, const int rows_2, __global const float *restrict table_2
#define STEPS_OF(level, p) (step + level_step[level] + (p) * level_long[level])
#define LIST_OF(level, segment) (first + (level) * (n_segments + 1) + (segment)), block, amount

// Score one group of each pair: pair (segment, clip), place; out the best score of the group's starts.
__kernel void probe(
    const int n_pairs, const int frames_level, const int fold, CLIPS, SEGMENTS, STEPS,
    __global const int2 *restrict pair, __global const int *restrict place, __global float *restrict out)
{
    const int id = get_global_id(0);
    if (id >= n_pairs)
        return;
    const int segment = pair[id].x, clip = pair[id].y;
    const int p = place[id] >> SCALE_BITS, f0 = fold * (place[id] & ((1 << SCALE_BITS) - 1));
    const int n_left = count_starts(clip_frames[clip], segment_frames[segment], numerator[p]) - f0;
    const int n = n_left < fold ? n_left : fold;
    const float8 sum = exact_of_8(frame + clip_first[clip] + f0, STEPS_OF(frames_level, p),
        weight + p * level_long[frames_level], LIST_OF(frames_level, segment));
    const float score = music_sum[segment] - least_of_8(sum, n);
    out[id] = score > 0.0f ? score : 0.0f;
}

// Depth first. A *run* is up to RUN pairs of one clip: run[r] is the first of run r, their first bound is of one
// table, so they take it together where all blocks count (`dense`, (n_segments, n_blocks)); else a run is one pair, by its
// list. least_score[pair]: what a start must reach. With most = 0, the best score found (-1: none) goes to found[pair] and
// prunes on; else every start with score + margin >= least_score is written, `most` at most, and counted.
// Groups that pass the first bound wait, as spans of 8 starts, so that what follows takes up to four of them together.
#define WAITING 64

// what one pair of a run has waiting
typedef struct {
    int n;
    int from[WAITING];
    float wanted, best;
} Pair;

static void go_on(
    Pair *its, const int p, const int id, const int most, CLIPS, SEGMENTS, STEPS, TABLES,
    __global const int2 *restrict pair, __global int *restrict count, __global int2 *restrict emitted)
{
    const int segment = pair[id].x, clip = pair[id].y, stride = clip_stride[clip];
    const size_t base = clip_first[clip];
    const int n_starts = count_starts(clip_frames[clip], segment_frames[segment], numerator[p]);
    const float a_sum = music_sum[segment], slack = margin[segment];
    int *from = its->from, n = its->n;
    float wanted = its->wanted;
    float8 sum[4];
    for (int level = 1; level < n_bounds; ++level) {
        __global const float *rows = level == 1 ? table_1 + base * rows_1 : table_2 + base * rows_2;
        int passed = 0;
        for (int g = 0; g < n;) {
            const int left = n - g, taken = left > 2 ? 4 : left;
            if (left == 3)
                from[n] = from[g];
            if (taken == 4)
                sums_of_4(rows, from + g, stride, STEPS_OF(level, p), LIST_OF(level, segment), sum);
            else if (taken == 2)
                sums_of_2(rows, from + g, stride, STEPS_OF(level, p), LIST_OF(level, segment), sum);
            else
                sums_of_1(rows, from + g, stride, STEPS_OF(level, p), LIST_OF(level, segment), sum);
            for (int j = 0; j < taken && j < left; ++j) {
                const int f0 = from[g + j];
                from[passed] = f0;
                passed += a_sum + slack - least_of_8(sum[j], n_starts - f0) >= wanted;
            }
            g += taken;
        }
        n = passed;
    }
    for (int g = 0; g < n;) {
        const int left = n - g, taken = left > 2 ? 4 : left;
        __global const float *in = frame + base;
        __global const float *weights = weight + p * level_long[n_bounds];
        if (left == 3)
            from[n] = from[g];
        if (taken == 4)
            exact_of_4(in, from + g, STEPS_OF(n_bounds, p), weights, LIST_OF(n_bounds, segment), sum);
        else if (taken == 2)
            exact_of_2(in, from + g, STEPS_OF(n_bounds, p), weights, LIST_OF(n_bounds, segment), sum);
        else
            exact_of_1(in, from + g, STEPS_OF(n_bounds, p), weights, LIST_OF(n_bounds, segment), sum);
        for (int j = 0; j < taken && j < left; ++j) {
            const int f0 = from[g + j], starts = SMALLER(n_starts - f0, 8);
            float top = a_sum - least_of_8(sum[j], starts);
            top = top > 0.0f ? top : 0.0f;
            if (most == 0) {
                its->best = top > its->best ? top : its->best;
                wanted = top > wanted ? top : wanted;
            } else if (top + slack >= wanted) {
                union { float8 v; float lane[8]; } exact;
                exact.v = sum[j];
                for (int start = 0; start < starts; ++start)
                    if (a_sum - exact.lane[start] + slack >= wanted || slack >= wanted) {
                        const int at = atomic_inc(count);
                        if (at < most)
                            emitted[at] = (int2)(id, (p << SCALE_BITS) + f0 + start);
                    }
            }
        }
        g += taken;
    }
    its->wanted = wanted;
    its->n = 0;
}

static float least_of(const VEC v)
{
#if LANES == 16
    const float8 eight = v.lo < v.hi ? v.lo : v.hi;
    const float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
#elif LANES == 8
    const float4 four = v.lo < v.hi ? v.lo : v.hi;
#else
    const float4 four = v;
#endif
    const float2 two = four.lo < four.hi ? four.lo : four.hi;
    return SMALLER(two.x, two.y);
}

// the first bounds of LANES groups for RUN segments
static void bounds_together(
    __global const float *rows, const int columns, __global const int2 *steps, const int n_blocks,
    __global const float *const *dense, VEC *out)
{
    VEC sum[RUN];
    #pragma unroll
    for (int s = 0; s < RUN; ++s)
        sum[s] = (VEC)(0.0f);
    for (int k = 0; k < n_blocks; k += 4) {
        const int2 k0 = steps[k], k1 = steps[k + 1], k2 = steps[k + 2], k3 = steps[k + 3];
        // a block past the end of a shorter segment may lie outside the clip: read anything, it adds nothing
        const VEC b0 = LOAD(rows + (size_t)k0.x * columns + SMALLER(k0.y, columns));
        const VEC b1 = LOAD(rows + (size_t)k1.x * columns + SMALLER(k1.y, columns));
        const VEC b2 = LOAD(rows + (size_t)k2.x * columns + SMALLER(k2.y, columns));
        const VEC b3 = LOAD(rows + (size_t)k3.x * columns + SMALLER(k3.y, columns));
        #pragma unroll
        for (int s = 0; s < RUN; ++s) {
            __global const float *a = dense[s] + 2 * k;
            ADD_TERMS(sum[s], b0, b1, b2, b3, a[0], a[2], a[4], a[6], a[1], a[3], a[5], a[7]);
        }
    }
    #pragma unroll
    for (int s = 0; s < RUN; ++s)
        out[s] = sum[s];
}

__kernel void refine(
    const int n_runs, const int most, CLIPS, SEGMENTS, STEPS, TABLES,
    const int block_frames, const int n_blocks, __global const float *restrict dense, __global const int *restrict run,
    __global const int2 *restrict pair, __global const float *restrict least_score,
    __global float *restrict found, __global int *restrict count, __global int2 *restrict emitted)
{
    const int r = get_global_id(0);
    if (r >= n_runs)
        return;
    const int id = run[r], n = run[r + 1] - id, clip = pair[id].y, columns = clip_stride[clip] / fold;
    __global const float *rows = folded + (size_t)clip_first[clip] * fold_rows;
    Pair its[RUN];
    __global const float *amounts[RUN];
    int frames[RUN], shortest = segment_frames[pair[id].x], longest = shortest;
    for (int s = 0; s < RUN; ++s) {
        const int pair_id = id + SMALLER(s, n - 1), segment = pair[pair_id].x;
        its[s].n = 0;
        its[s].wanted = least_score[pair_id];
        its[s].best = -1.0f;
        amounts[s] = dense + (size_t)segment * n_blocks * 2;
        frames[s] = segment_frames[segment];
        shortest = SMALLER(frames[s], shortest);
        longest = longest < frames[s] ? frames[s] : longest;
    }
    const int blocks = SMALLER(((longest + block_frames - 1) / block_frames + 3) / 4 * 4, n_blocks);
    for (int p = 0; p < n_scales; ++p) {
        int n_groups[RUN];
        for (int s = 0; s < n; ++s)
            n_groups[s] = (count_starts(clip_frames[clip], frames[s], numerator[p]) + fold - 1) / fold;
        const int n_most = (count_starts(clip_frames[clip], shortest, numerator[p]) + fold - 1) / fold;
        for (int i = 0; i < n_most; i += LANES) {
            union { VEC v[RUN]; float lane[RUN][LANES]; } bound;
            if (n_bounds == 0)
                bound.v[0] = (VEC)(0.0f);
            else if (n > 1)
                bounds_together(rows + i, columns, STEPS_OF(0, p), blocks, amounts, bound.v);
            else
                bounds_of_1(rows + i, columns, STEPS_OF(0, p), LIST_OF(0, pair[id].x), bound.v);
            for (int s = 0; s < n; ++s) {
                const int segment = pair[id + s].x, here = SMALLER(n_groups[s] - i, LANES);
                const float limit = music_sum[segment] + margin[segment] - its[s].wanted;
                if (least_of(bound.v[s]) <= limit) {
                    int waiting = its[s].n, last = waiting > 0 ? its[s].from[waiting - 1] : -1;
                    for (int lane = 0; lane < here; ++lane) {
                        const int from = fold * (i + lane) & ~7;
                        if (bound.lane[s][lane] <= limit && from != last) {
                            its[s].from[waiting++] = from;
                            last = from;
                        }
                    }
                    its[s].n = waiting;
                }
                if (its[s].n > 0 && (its[s].n + LANES >= WAITING || i + LANES >= n_groups[s]))
                    go_on(its + s, p, id + s, most, clip_first, clip_stride, clip_frames, frame, n_segments, music_sum, margin,
                        segment_frames, first, block, amount, n_scales, numerator, step, weight, level_step, level_long,
                        n_bounds, fold, fold_rows, folded, rows_1, table_1, rows_2, table_2, pair, count, emitted);
            }
        }
    }
    if (most == 0)
        for (int s = 0; s < n; ++s)
            found[id + s] = its[s].best;
}

// Level by level, first: the groups of each pair that reach least_score by the first bound. Written as (pair, place of the
// group), `most` at most, and counted. One work-item owns LANES groups of one scale of one pair.
__kernel void level_first(
    const int n_pairs, const int most, CLIPS, SEGMENTS, STEPS, TABLES,
    __global const int2 *restrict pair, __global const float *restrict least_score,
    __global int *restrict count, __global int2 *restrict out)
{
    const int id = get_global_id(2), p = get_global_id(1), i = get_global_id(0) * LANES;
    if (id >= n_pairs || p >= n_scales)
        return;
    const int segment = pair[id].x, clip = pair[id].y;
    const int n_groups = (count_starts(clip_frames[clip], segment_frames[segment], numerator[p]) + fold - 1) / fold;
    if (i >= n_groups)
        return;
    union { VEC v; float lane[LANES]; } bound;
    bound.v = (VEC)(0.0f);
    if (n_bounds > 0) {
        __global const int2 *steps = STEPS_OF(0, p);
        __global const float *rows = folded + (size_t)clip_first[clip] * fold_rows + i;
        const int columns = clip_stride[clip] / fold;
        VEC sum = (VEC)(0.0f);
        for (int j = first[segment]; j < first[segment + 1]; j += 4) {
            const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]], k2 = steps[block[j + 2]], k3 = steps[block[j + 3]];
            const VEC b0 = LOAD(rows + (size_t)k0.x * columns + k0.y), b1 = LOAD(rows + (size_t)k1.x * columns + k1.y);
            const VEC b2 = LOAD(rows + (size_t)k2.x * columns + k2.y), b3 = LOAD(rows + (size_t)k3.x * columns + k3.y);
            const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3];
            ADD_TERMS(sum, b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y);
        }
        bound.v = sum;
    }
    for (int lane = 0; lane < LANES && i + lane < n_groups; ++lane)
        if (music_sum[segment] - bound.lane[lane] + margin[segment] >= least_score[id]) {
            const int at = atomic_inc(count);
            if (at < most)
                out[at] = (int2)(id, (p << SCALE_BITS) + i + lane);
        }
}

// Level by level, a finer bound: groups in, groups that still reach least_score out. One work-item owns one group.
__kernel void level_next(
    const int n_groups, const int level, CLIPS, SEGMENTS, STEPS, TABLES,
    __global const int2 *restrict pair, __global const float *restrict least_score,
    __global const int2 *restrict in, __global int *restrict count, __global int2 *restrict out)
{
    const int id = get_global_id(0);
    if (id >= n_groups)
        return;
    const int segment = pair[in[id].x].x, clip = pair[in[id].x].y;
    const int p = in[id].y >> SCALE_BITS, f0 = fold * (in[id].y & ((1 << SCALE_BITS) - 1));
    const int n_left = count_starts(clip_frames[clip], segment_frames[segment], numerator[p]) - f0;
    const int n = n_left < fold ? n_left : fold;
    __global const float *rows = level == 1 ? table_1 : table_2;
    const int n_rows = level == 1 ? rows_1 : rows_2;
    const float8 sum = sum_of_8(rows + (size_t)clip_first[clip] * n_rows + f0, clip_stride[clip], STEPS_OF(level, p),
        LIST_OF(level, segment));
    if (music_sum[segment] - least_of_8(sum, n) + margin[segment] >= least_score[in[id].x])
        out[atomic_inc(count)] = in[id];
}

// Level by level, last: scores of the groups' starts, as in refine. found holds bits of floats >= 0, or of -1 as an int.
__kernel void level_last(
    const int n_groups, const int most, CLIPS, SEGMENTS, STEPS, TABLES,
    __global const int2 *restrict pair, __global const float *restrict least_score,
    __global const int2 *restrict in,
    __global int *restrict found, __global int *restrict count, __global int2 *restrict emitted)
{
    const int id = get_global_id(0);
    if (id >= n_groups)
        return;
    const int segment = pair[in[id].x].x, clip = pair[in[id].x].y;
    const int p = in[id].y >> SCALE_BITS, f0 = fold * (in[id].y & ((1 << SCALE_BITS) - 1));
    const int n_left = count_starts(clip_frames[clip], segment_frames[segment], numerator[p]) - f0;
    const int n = n_left < fold ? n_left : fold;
    union { float8 v; float lane[8]; } exact;
    exact.v = exact_of_8(frame + clip_first[clip] + f0, STEPS_OF(n_bounds, p), weight + p * level_long[n_bounds],
        LIST_OF(n_bounds, segment));
    float best = -1.0f;
    for (int start = 0; start < n; ++start) {
        float score = music_sum[segment] - exact.lane[start];
        score = score > 0.0f ? score : 0.0f;
        best = score > best ? score : best;
        if (most > 0 && score + margin[segment] >= least_score[in[id].x]) {
            const int at = atomic_inc(count);
            if (at < most)
                emitted[at] = (int2)(in[id].x, (p << SCALE_BITS) + f0 + start);
        }
    }
    if (most == 0 && best >= 0.0f)
        atomic_max(found + in[id].x, as_int(best));
}
