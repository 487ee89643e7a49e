// What kernels of matrices do with real numbers, in C; `bf/kernels/linear_algebra.hpp` and `svd.hpp` say the
// equations. Matrices lie column by column. Where those kernels work in tiles, each element still has its
// terms in this order.
#include "c_language.hpp"

namespace bf::codegen {

const CDefinitions& c_matrix_definitions() {
    static const CDefinitions all{
        {"copy", R"(static void @name@(@T@ *y, const @T@ *x, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        y[i] = x[i];
    }
}
)"},
        {"transpose", R"(static void @name@(@T@ *y, const @T@ *x, int32_t rows, int32_t cols)
{
    for (int32_t j = 0; j < cols; ++j) {
        for (int32_t i = 0; i < rows; ++i) {
            y[j + (i * cols)] = x[i + (j * rows)];
        }
    }
}
)"},
        {"identity", R"(static void @name@(@T@ *y, int32_t n)
{
    for (int32_t i = 0; i < (n * n); ++i) {
        y[i] = ((i % (n + 1)) == 0) ? @one@ : @zero@;
    }
}
)"},
        {"add_scaled", R"(static void @name@(@T@ *y, const @T@ *x, @T@ f, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        y[i] += x[i] * f;
    }
}
)"},
        {"swap_rows", R"(static void @name@(@T@ *a, int32_t p, int32_t q, int32_t rows, int32_t cols)
{
    for (int32_t j = 0; j < cols; ++j) {
        const @T@ kept = a[p + (j * rows)];
        a[p + (j * rows)] = a[q + (j * rows)];
        a[q + (j * rows)] = kept;
    }
}
)"},
        // b = inverse(a) b by LU with partial pivoting; a becomes its factors. False where a is singular.
        {"lu_solve", R"(static bool @name@(@T@ *a, @T@ *b, int32_t n, int32_t cols)
{
    bool regular = true;
    for (int32_t k = 0; k < n; ++k) {
        const int32_t below = n - k - 1;
        int32_t p = k;
        for (int32_t i = k + 1; i < n; ++i) {
            if (fabs@f@(a[i + (k * n)]) > fabs@f@(a[p + (k * n)])) {
                p = i;
            }
        }
        if (p != k) {
            @swap_rows@(a, k, p, n, n);
            @swap_rows@(b, k, p, n, cols);
        }
        const @T@ pivot = a[k + (k * n)];
        @T@ *const factors = &a[k + 1 + (k * n)];
        regular = regular && (pivot != @zero@) && (isfinite(pivot) != 0);
        for (int32_t i = 0; i < below; ++i) {
            factors[i] /= pivot;
        }
        for (int32_t j = k + 1; j < n; ++j) {
            @add_scaled@(&a[k + 1 + (j * n)], factors, -a[k + (j * n)], below);
        }
        for (int32_t j = 0; j < cols; ++j) {
            @add_scaled@(&b[k + 1 + (j * n)], factors, -b[k + (j * n)], below);
        }
    }
    for (int32_t j = 0; j < cols; ++j) {
        for (int32_t k = n - 1; k >= 0; --k) {
            b[k + (j * n)] /= a[k + (k * n)];
            @add_scaled@(&b[j * n], &a[k * n], -b[k + (j * n)], k);
        }
    }
    return regular;
}
)"},
        {"solve",
         R"(static bool @name@(@T@ *x, const @T@ *a, const @T@ *b, @T@ *work, int32_t n, int32_t cols)
{
    @copy@(work, a, n * n);
    @copy@(x, b, n * cols);
    return @lu_solve@(work, x, n, cols);
}
)"},
        {"solve_right",
         R"(static bool @name@(@T@ *x, const @T@ *b, const @T@ *a, @T@ *work, int32_t n, int32_t rows)
{
    @T@ *const z = &work[n * n];
    @transpose@(work, a, n, n);
    @transpose@(z, b, rows, n);
    const bool regular = @lu_solve@(work, z, n, rows);
    @transpose@(x, z, n, rows);
    return regular;
}
)"},
        {"inverse", R"(static bool @name@(@T@ *y, const @T@ *a, @T@ *work, int32_t n)
{
    @copy@(work, a, n * n);
    @identity@(y, n);
    return @lu_solve@(work, y, n, n);
}
)"},
        // a = u d transpose(u), in z u d with 1/d on its diagonal below transpose(b); as in the kernel, four
        // columns from low to high leave out what is 0 for all of them.
        {"cholesky_solve",
         R"(static bool @name@(@T@ *x, const @T@ *a, const @T@ *b, @T@ *z, int32_t n, int32_t cols)
{
    const int32_t height = n + cols;
    const int32_t fours = n - (n % 4);
    bool positive = true;
    for (int32_t j = 0; j < n; ++j) {
        for (int32_t i = 0; i < cols; ++i) {
            z[i + (j * height)] = b[j + (i * n)];
        }
        for (int32_t i = 0; i <= j; ++i) {
            z[cols + i + (j * height)] = a[j + (i * n)];
        }
    }
    for (int32_t j = n - 1; j >= 0; --j) {
        const int32_t low = (j < fours) ? (j - (j % 4)) : j;
        const int32_t high = (j < fours) ? (low + 3) : j;
        for (int32_t k = n - 1; k > j; --k) {
            bool is_live = (k <= high);
            for (int32_t i = low; i <= high; ++i) {
                is_live = is_live || (z[cols + i + (k * height)] != @zero@);
            }
            if (is_live) {
                const @T@ factor = z[cols + j + (k * height)] * z[cols + k + (k * height)];
                for (int32_t i = 0; i <= (cols + j); ++i) {
                    z[i + (j * height)] -= z[i + (k * height)] * factor;
                }
            }
        }
        const @T@ pivot = z[cols + j + (j * height)];
        const bool is_good = (pivot > @zero@) && (isfinite(pivot) != 0);
        positive = positive && is_good;
        z[cols + j + (j * height)] = is_good ? (@one@ / pivot) : (@T@)NAN;
    }
    for (int32_t j = 0; j < n; ++j) {
        const int32_t low = (j < fours) ? (j - (j % 4)) : j;
        const int32_t high = (j < fours) ? (low + 3) : j;
        for (int32_t k = 0; k < j; ++k) {
            bool is_live = (k >= low);
            for (int32_t i = low; i <= high; ++i) {
                is_live = is_live || (z[cols + k + (i * height)] != @zero@);
            }
            if (is_live) {
                for (int32_t i = 0; i < cols; ++i) {
                    z[i + (j * height)] -= z[i + (k * height)] * z[cols + k + (j * height)];
                }
            }
        }
        for (int32_t i = 0; i < cols; ++i) {
            z[i + (j * height)] *= z[cols + j + (j * height)];
            x[j + (i * n)] = z[i + (j * height)];
        }
    }
    return positive;
}
)"},
        // a has rows x cols; y = transpose(a) inverse(a transpose(a) + damping I), or the same from the left.
        {"damped_pinv",
         R"(static bool @name@(@T@ *y, @T@ damping, const @T@ *a, @T@ *work, int32_t rows, int32_t cols)
{
    const bool is_wide = (rows <= cols);
    const int32_t n = is_wide ? rows : cols;
    const int32_t m = is_wide ? cols : rows;
    @T@ *const z = is_wide ? &work[n * n] : y;
    if (is_wide) {
        @copy@(z, a, rows * cols);
    } else {
        @transpose@(z, a, rows, cols);
    }
    for (int32_t i = 0; i < (n * n); ++i) {
        work[i] = @zero@;
    }
    for (int32_t k = 0; k < m; ++k) {
        for (int32_t j = 0; j < n; ++j) {
            @add_scaled@(&work[j * n], &z[k * n], z[j + (k * n)], n);
        }
    }
    for (int32_t i = 0; i < n; ++i) {
        work[i + (i * n)] += damping;
    }
    const bool regular = @lu_solve@(work, z, n, m);
    if (is_wide) {
        @transpose@(y, z, n, m);
    }
    return regular;
}
)"},
        {"dot", R"(static @T@ @name@(const @T@ *x, const @T@ *y, int32_t n)
{
    @T@ sum[4] = {0};
    const int32_t whole = n - (n % 4);
    for (int32_t i = 0; i < n; ++i) {
        const int32_t place = (i < whole) ? (i % 4) : 0;
        sum[place] += x[i] * y[i];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}
)"},
        {"rotate", R"(static void @name@(@T@ *x, @T@ *y, @T@ c, @T@ s, int32_t n)
{
    for (int32_t i = 0; i < n; ++i) {
        const @T@ kept = x[i];
        x[i] = (c * kept) - (s * y[i]);
        y[i] = (s * kept) + (c * y[i]);
    }
}
)"},
        // One-sided Jacobi: the columns of g (p x q) become orthogonal, g = g0 v. False after 40 sweeps.
        {"orthogonalize", R"(static bool @name@(@T@ *g, @T@ *v, int32_t p, int32_t q)
{
    const @T@ small = @epsilon@ * (@T@)p;
    const @T@ nothing = (@epsilon@ * @epsilon@) * sqrt@f@(@dot@(g, g, p * q));
    bool is_done = false;
    @identity@(v, q);
    for (int32_t sweep = 0; (sweep < 40) && (!is_done); ++sweep) {
        is_done = true;
        for (int32_t i = 0; i < (q - 1); ++i) {
            for (int32_t j = i + 1; j < q; ++j) {
                @T@ *const x = &g[i * p];
                @T@ *const y = &g[j * p];
                const @T@ xx = @dot@(x, x, p);
                const @T@ yy = @dot@(y, y, p);
                const @T@ xy = @dot@(x, y, p);
                if (!((fabs@f@(xy) <= (small * (sqrt@f@(xx) * sqrt@f@(yy)))) ||
                      (sqrt@f@((xx < yy) ? xx : yy) <= nothing))) {
                    const @T@ zeta = (yy - xx) / (@two@ * xy);
                    const @T@ root = fabs@f@(zeta) + sqrt@f@(@one@ + (zeta * zeta));
                    const @T@ t = (zeta < @zero@) ? (-@one@ / root) : (@one@ / root);
                    const @T@ c = @one@ / sqrt@f@(@one@ + (t * t));
                    is_done = false;
                    @rotate@(x, y, c, c * t, p);
                    @rotate@(&v[i * q], &v[j * q], c, c * t, q);
                }
            }
        }
    }
    return is_done;
}
)"},
        // Over the singular values above the tolerance; a negative one stands for what rounding leaves.
        {"truncated_pinv",
         R"(static bool @name@(@T@ *y, @T@ tolerance, const @T@ *a, @T@ *work, int32_t rows, int32_t cols)
{
    const bool is_tall = (rows >= cols);
    const int32_t q = is_tall ? cols : rows;
    const int32_t p = is_tall ? rows : cols;
    @T@ *const v = work;
    @T@ *const g = &work[q * q];
    if (is_tall) {
        @copy@(g, a, rows * cols);
    } else {
        @transpose@(g, a, rows, cols);
    }
    const bool is_found = @orthogonalize@(g, v, p, q);
    @T@ limit = tolerance;
    @T@ largest = @zero@;
    for (int32_t k = 0; k < q; ++k) {
        largest = @maximum@(largest, sqrt@f@(@dot@(&g[k * p], &g[k * p], p)));
    }
    if (limit < @zero@) {
        limit = (@T@)p * (nextafter@f@(largest, @largest@) - largest);
    }
    for (int32_t i = 0; i < (rows * cols); ++i) {
        y[i] = @zero@;
    }
    for (int32_t k = 0; k < q; ++k) {
        const @T@ *const left = is_tall ? &v[k * q] : &g[k * p];
        const @T@ *const right = is_tall ? &g[k * p] : &v[k * q];
        const @T@ sigma = sqrt@f@(@dot@(&g[k * p], &g[k * p], p));
        if (!(sigma <= limit)) {
            for (int32_t j = 0; j < rows; ++j) {
                @add_scaled@(&y[j * cols], left, (right[j] / sigma) / sigma, cols);
            }
        }
    }
    return is_found;
}
)"},
        // The sum of the squares of a row's elements from `first` on.
        {"square_from", R"(static @T@ @name@(const @T@ *a, @T@ sum, int32_t first, int32_t n, int32_t step)
{
    @T@ all = sum;
    for (int32_t i = first; i < n; ++i) {
        all += a[i * step] * a[i * step];
    }
    return all;
}
)"},
        // Householder QR with column pivoting of (a b): a is m x n, b m x p, `order` the columns' places. The
        // rank, or -1 where something is not finite.
        {"pivoted_qr", R"(static int32_t @name@(@T@ *qr, @T@ *order, int32_t m, int32_t n, int32_t p)
{
    const int32_t most = (m < n) ? m : n;
    int32_t rank = 0;
    @T@ smallest = @zero@;
    bool is_finite = true;
    bool goes_on = true;
    for (int32_t k = 0; (k < most) && goes_on; ++k) {
        int32_t pivot = k;
        @T@ square = -@one@;
        for (int32_t j = k; j < n; ++j) {
            const @T@ sum = @square_from@(&qr[j * m], @zero@, k, m, 1);
            is_finite = is_finite && (isfinite(sum) != 0);
            if (sum > square) {
                square = sum;
                pivot = j;
            }
        }
        for (int32_t i = 0; (i < m) && (pivot != k); ++i) {
            const @T@ kept = qr[i + (k * m)];
            qr[i + (k * m)] = qr[i + (pivot * m)];
            qr[i + (pivot * m)] = kept;
        }
        const @T@ place = order[k];
        order[k] = order[pivot];
        order[pivot] = place;
        const @T@ norm = sqrt@f@(square);
        if (k == 0) {
            smallest = (@T@)((m > n) ? m : n) * @epsilon@ * norm;
        }
        goes_on = (norm > smallest);
        if (goes_on) {
            const @T@ head = qr[k + (k * m)];
            const @T@ r = (head > @zero@) ? -norm : norm;
            const @T@ half = norm * (norm + fabs@f@(head));
            rank = k + 1;
            qr[k + (k * m)] = head - r;
            for (int32_t j = k + 1; j < (n + p); ++j) {
                @T@ sum = @zero@;
                for (int32_t i = k; i < m; ++i) {
                    sum += qr[i + (k * m)] * qr[i + (j * m)];
                }
                @add_scaled@(&qr[k + (j * m)], &qr[k + (k * m)], -(sum / half), m - k);
            }
            qr[k + (k * m)] = r;
        }
    }
    return is_finite ? rank : -1;
}
)"},
        // (R S) of a deficient rank becomes (L 0), by reflections from the right, whose vectors stay in S.
        {"reflect_rows", R"(static void @name@(@T@ *qr, int32_t m, int32_t n, int32_t rank)
{
    for (int32_t k = rank - 1; k >= 0; --k) {
        @T@ *const row = &qr[k];
        const @T@ pivot = row[k * m];
        const @T@ norm = sqrt@f@(@square_from@(row, pivot * pivot, rank, n, m));
        const @T@ diagonal = (pivot > @zero@) ? -norm : norm;
        const @T@ head = pivot - diagonal;
        for (int32_t j = rank; j < n; ++j) {
            row[j * m] /= head;
        }
        row[k * m] = diagonal;
        const @T@ f = @two@ / @square_from@(row, @one@, rank, n, m);
        for (int32_t i = 0; i < k; ++i) {
            @T@ along = qr[i + (k * m)];
            for (int32_t j = rank; j < n; ++j) {
                along += qr[i + (j * m)] * row[j * m];
            }
            qr[i + (k * m)] -= f * along;
            for (int32_t j = rank; j < n; ++j) {
                qr[i + (j * m)] -= f * along * row[j * m];
            }
        }
    }
}
)"},
        {"least_squares",
         R"(static bool @name@(@T@ *x, const @T@ *a, const @T@ *b, @T@ *work, int32_t m, int32_t n, int32_t p)
{
    @T@ *const qr = work;
    @T@ *const order = &work[m * (n + p)];
    @copy@(qr, a, m * n);
    @copy@(&qr[m * n], b, m * p);
    for (int32_t j = 0; j < n; ++j) {
        order[j] = (@T@)j;
    }
    const int32_t found = @pivoted_qr@(qr, order, m, n, p);
    const int32_t rank = (found < 0) ? 0 : found;
    if (rank < n) {
        @reflect_rows@(qr, m, n, rank);
    }
    for (int32_t i = 0; i < (n * p); ++i) {
        x[i] = @zero@;
    }
    for (int32_t j = 0; j < p; ++j) {
        @T@ *const c = &qr[(n + j) * m];
        @T@ *const y = &x[j * n];
        for (int32_t k = rank - 1; k >= 0; --k) {
            c[k] /= qr[k + (k * m)];
            @add_scaled@(c, &qr[k * m], -c[k], k);
            y[(int32_t)order[k]] = c[k];
        }
        for (int32_t k = 0; (k < rank) && (rank < n); ++k) {
            @T@ along = y[(int32_t)order[k]];
            for (int32_t i = rank; i < n; ++i) {
                along += qr[k + (i * m)] * y[(int32_t)order[i]];
            }
            along *= @two@ / @square_from@(&qr[k], @one@, rank, n, m);
            y[(int32_t)order[k]] -= along;
            for (int32_t i = rank; i < n; ++i) {
                y[(int32_t)order[i]] -= along * qr[k + (i * m)];
            }
        }
    }
    return (found >= 0);
}
)"}};
    return all;
}

} // namespace bf::codegen
