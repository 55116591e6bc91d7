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

// the sums of 8 starts from f0 over a list, by a table's rows
static float8 sum_of_8(
    __global const float *rows, const size_t stride, __global const int2 *steps,
    __global const int *first, __global const int *block, __global const float2 *amount)
{
    float8 sum = (float8)(0.0f);
    for (int j = first[0]; j < first[1]; j += 4) {
        const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]], k2 = steps[block[j + 2]], k3 = steps[block[j + 3]];
        const float8 b0 = LOAD8(rows + k0.x * stride + k0.y), b1 = LOAD8(rows + k1.x * stride + k1.y);
        const float8 b2 = LOAD8(rows + k2.x * stride + k2.y), b3 = LOAD8(rows + k3.x * stride + k3.y);
        const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3];
        ADD_TERMS(sum, b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y);
    }
    return sum;
}

// the sums of 8 starts over the frames, interpolated here
static float8 exact_of_8(
    __global const float *in, __global const int2 *steps, __global const float *weights,
    __global const int *first, __global const int *block, __global const float2 *amount)
{
    float8 sum = (float8)(0.0f);
    for (int j = first[0]; j < first[1]; j += 4) {
        float8 b[4];
        #pragma unroll
        for (int i = 0; i < 4; ++i) {
            const int f = block[j + i];
            __global const float *at = in + steps[f].y;
            const float w = weights[f];
            b[i] = (1.0f - w) * LOAD8(at) + w * LOAD8(at + 1);
        }
        const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3];
        ADD_TERMS(sum, b[0], b[1], b[2], b[3], a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y);
    }
    return sum;
}

// the smallest of the first n of 8
static float least_of_8(const float8 sum, const int n)
{
    union { float8 v; float lane[8]; } x;
    x.v = sum;
    float least = x.lane[0];
    for (int i = 1; i < 8; ++i)
        least = i < n && x.lane[i] < least ? x.lane[i] : least;
    return least;
}

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

// Depth first. least_score[pair]: what a start must reach. With most = 0, the best score found (-1: none) goes to
// found[pair] and prunes on; else every start with score + margin >= least_score is written, `most` at most, and counted.
__kernel void refine(
    const int n_pairs, const int most, CLIPS, SEGMENTS, STEPS, TABLES,
    __global const int2 *restrict pair, __global const float *restrict least_score,
    __global float *restrict found, __global int *restrict count, __global int2 *restrict emitted)
{
    const int id = get_global_id(0);
    if (id >= n_pairs)
        return;
    const int segment = pair[id].x, clip = pair[id].y;
    const size_t base = clip_first[clip];
    const int stride = clip_stride[clip];
    const float a_sum = music_sum[segment], slack = margin[segment];
    float wanted = least_score[id], best = -1.0f;
    for (int p = 0; p < n_scales; ++p) {
        const int n_starts = count_starts(clip_frames[clip], segment_frames[segment], numerator[p]);
        const int n_groups = (n_starts + fold - 1) / fold;
        for (int i = 0; i < n_groups; i += LANES) {
            union { VEC v; float lane[LANES]; } bound;
            bound.v = (VEC)(0.0f);
            if (n_bounds > 0) {
                __global const int2 *steps = STEPS_OF(0, p);
                __global const float *rows = folded + base * fold_rows + i;
                const int columns = stride / fold;
                VEC sum = (VEC)(0.0f);
                for (int j = first[segment]; j < first[segment + 1]; j += 4) {
                    const int2 k0 = steps[block[j]], k1 = steps[block[j + 1]];
                    const int2 k2 = steps[block[j + 2]], k3 = steps[block[j + 3]];
                    const VEC b0 = LOAD(rows + (size_t)k0.x * columns + k0.y);
                    const VEC b1 = LOAD(rows + (size_t)k1.x * columns + k1.y);
                    const VEC b2 = LOAD(rows + (size_t)k2.x * columns + k2.y);
                    const VEC b3 = LOAD(rows + (size_t)k3.x * columns + k3.y);
                    const float2 a0 = amount[j], a1 = amount[j + 1], a2 = amount[j + 2], a3 = amount[j + 3];
                    ADD_TERMS(sum, b0, b1, b2, b3, a0.x, a1.x, a2.x, a3.x, a0.y, a1.y, a2.y, a3.y);
                }
                bound.v = sum;
            }
            const int here = n_groups - i < LANES ? n_groups - i : LANES;
            for (int lane = 0; lane < here; ++lane) {
                if (a_sum - bound.lane[lane] + slack < wanted)
                    continue;
                const int f0 = fold * (i + lane);
                const int n = n_starts - f0 < fold ? n_starts - f0 : fold;
                if (n_bounds > 1 && a_sum + slack - least_of_8(sum_of_8(table_1 + base * rows_1 + f0, stride,
                        STEPS_OF(1, p), LIST_OF(1, segment)), n) < wanted)
                    continue;
                if (n_bounds > 2 && a_sum + slack - least_of_8(sum_of_8(table_2 + base * rows_2 + f0, stride,
                        STEPS_OF(2, p), LIST_OF(2, segment)), n) < wanted)
                    continue;
                union { float8 v; float lane[8]; } exact;
                exact.v = exact_of_8(frame + base + f0, STEPS_OF(n_bounds, p), weight + p * level_long[n_bounds],
                    LIST_OF(n_bounds, segment));
                for (int start = 0; start < n; ++start) {
                    float score = a_sum - exact.lane[start];
                    score = score > 0.0f ? score : 0.0f;
                    if (most > 0) {
                        if (score + slack >= wanted) {
                            const int at = atomic_inc(count);
                            if (at < most)
                                emitted[at] = (int2)(id, (p << SCALE_BITS) + f0 + start);
                        }
                    } else {
                        best = score > best ? score : best;
                        wanted = score > wanted ? score : wanted;
                    }
                }
            }
        }
    }
    if (most == 0)
        found[id] = best;
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
