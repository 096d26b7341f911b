// Plain loops over structure-of-arrays doubles that a compiler vectorises, one JSON line a case: the fastest way known
// for each formula, in one thread. Times are processor time, the best of many.
//
// usage: strong [POINTS]
// build: c++ -O3 -march=native -mprefer-vector-width=512 -ffp-contract=off strong.cpp
//        c++ -O3 -march=native -mprefer-vector-width=512 -ffast-math -DFAST strong.cpp    (the equidistant case: it needs
//        a tangent for whole registers)
//
// The largest residual after distorting the answer again stands in each line, in normalised coordinates.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <time.h>
#include <vector>

using Doubles = std::vector<double>;
using Mask = std::vector<unsigned char>;

static const double fx = 458.654, fy = 457.296, cx = 367.215, cy = 248.375;
static const double k1 = -0.28340811, k2 = 0.07395907, p1 = 0.00019359, p2 = 1.76187114e-05;
static const double e1 = 0.0034823894, e2 = 0.00071503484, e3 = -0.0020532361, e4 = 0.00020293673;

static double cpu_seconds() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

template <class Work> static double best(int runs, Work work) {
    work();
    double least = 1e300;
    for (int i = 0; i < runs; i++) {
        double start = cpu_seconds();
        work();
        least = std::min(least, cpu_seconds() - start);
    }
    return least;
}

__attribute__((noinline)) static void project(size_t n, const double *__restrict X, const double *__restrict Y, const double *__restrict Z,
                                              double *__restrict u, double *__restrict v, unsigned char *__restrict ok, double r2_max) {
#pragma GCC ivdep
    for (size_t i = 0; i < n; i++) {
        double inverse_z = 1.0 / Z[i], x = X[i] * inverse_z, y = Y[i] * inverse_z, xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy;
        double radial = 1 + r2 * (k1 + r2 * k2);
        u[i] = fx * (x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx)) + cx;
        v[i] = fy * (y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy) + cy;
        ok[i] = (Z[i] > 0) & (r2 <= r2_max);
    }
}

// r / r_distorted as a polynomial in r_distorted^2, least squares over the valid radius: the seed of Newton's method.
static const int TERMS = 7;
static double seed[TERMS];

static void fit_seed(double r_max) {
    double a[TERMS][TERMS + 1] = {};
    for (int i = 0; i < 400; i++) {
        double r = r_max * (0.5 - 0.5 * cos((i + 0.5) / 400 * M_PI)), radial = 1 + r * r * (k1 + r * r * k2), rd2 = r * r * radial * radial;
        double row[TERMS] = {1};
        for (int k = 1; k < TERMS; k++) row[k] = row[k - 1] * rd2;
        for (int j = 0; j < TERMS; j++) {
            for (int k = 0; k < TERMS; k++) a[j][k] += row[j] * row[k];
            a[j][TERMS] += row[j] / radial;
        }
    }
    for (int i = 0; i < TERMS; i++) {
        int pivot = i;
        for (int r = i; r < TERMS; r++)
            if (fabs(a[r][i]) > fabs(a[pivot][i])) pivot = r;
        std::swap(a[i], a[pivot]);
        for (int r = 0; r < TERMS; r++) {
            if (r == i) continue;
            double f = a[r][i] / a[i][i];
            for (int c = i; c <= TERMS; c++) a[r][c] -= f * a[i][c];
        }
    }
    for (int k = 0; k < TERMS; k++) seed[k] = a[k][TERMS] / a[k][k];
}

template <int STEPS>
__attribute__((noinline)) static void unproject(size_t n, const double *__restrict U, const double *__restrict V, double *__restrict out_x,
                                                double *__restrict out_y, unsigned char *__restrict ok) {
    double c[TERMS];
    for (int k = 0; k < TERMS; k++) c[k] = seed[k];
#pragma GCC ivdep
    for (size_t i = 0; i < n; i++) {
        double xd = (U[i] - cx) * (1 / fx), yd = (V[i] - cy) * (1 / fy), rd2 = xd * xd + yd * yd, g = c[TERMS - 1];
#pragma GCC unroll 16
        for (int k = TERMS - 2; k >= 0; k--) g = g * rd2 + c[k];
        double x = xd * g, y = yd * g, step2 = 0;
        double sx = g * (2 * p1 * x * y + p2 * (3 * x * x + y * y)), sy = g * (p1 * (x * x + 3 * y * y) + 2 * p2 * x * y);
        x -= sx, y -= sy; // the tangential part, to first order
#pragma GCC unroll 8
        for (int k = 0; k < STEPS; k++) {
            double xx = x * x, yy = y * y, xy = x * y, r2 = xx + yy, d = 1 + r2 * (k1 + r2 * k2), dd = k1 + 2 * k2 * r2;
            double gx = x * d + 2 * p1 * xy + p2 * (r2 + 2 * xx) - xd, gy = y * d + p1 * (r2 + 2 * yy) + 2 * p2 * xy - yd;
            double a = d + 2 * xx * dd + 2 * p1 * y + 6 * p2 * x, b = 2 * xy * dd + 2 * p1 * x + 2 * p2 * y,
                   e = d + 2 * yy * dd + 6 * p1 * y + 2 * p2 * x;
            double q = 1.0 / (a * e - b * b), dx = (e * gx - b * gy) * q, dy = (a * gy - b * gx) * q;
            x -= dx, y -= dy, step2 = dx * dx + dy * dy;
        }
        out_x[i] = x, out_y[i] = y, ok[i] = step2 < 1e-12;
    }
}

// The angle alone is solved for: one dimension, no arc tangent, one tangent at the end.
__attribute__((noinline)) static void unproject_equidistant(size_t n, const double *__restrict U, const double *__restrict V, double *__restrict out_x,
                                                            double *__restrict out_y, unsigned char *__restrict ok) {
#pragma GCC ivdep
    for (size_t i = 0; i < n; i++) {
        double xd = (U[i] - cx) * (1 / fx), yd = (V[i] - cy) * (1 / fy), rd = sqrt(xd * xd + yd * yd), t = rd, step = 0;
#pragma GCC unroll 8
        for (int k = 0; k < 3; k++) {
            double s = t * t, f = t * (1 + s * (e1 + s * (e2 + s * (e3 + s * e4)))) - rd;
            double slope = 1 + s * (3 * e1 + s * (5 * e2 + s * (7 * e3 + s * 9 * e4))), d = f / slope;
            t -= d, step = fabs(d);
        }
        double q = rd > 1e-12 ? tan(t) / rd : 1.0;
        out_x[i] = xd * q, out_y[i] = yd * q, ok[i] = (step < 1e-7) & (t < 1.57);
    }
}

int main(int argc, char **argv) {
    size_t n = argc > 1 ? strtoull(argv[1], nullptr, 10) : 1000000;
    int runs = n > 5000000 ? 5 : n > 500000 ? 30 : 300;
    std::mt19937_64 generator(7);
    auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator); };
    Doubles X(n), Y(n), Z(n), U(n), V(n), a(n), b(n);
    Mask ok(n);
    for (size_t i = 0; i < n; i++) X[i] = between(-.7, .7), Y[i] = between(-.42, .42), Z[i] = between(1, 8), U[i] = between(20, 730), V[i] = between(20, 460);
    fit_seed(1.30);
    auto say = [&](const char *name, double seconds, double residual) {
        printf("{\"name\": \"%s\", \"n\": %zu, \"seconds\": %.9g, \"residual\": %.1e}\n", name, n, seconds, residual);
    };
#ifdef FAST
    double t = best(runs, [&] { unproject_equidistant(n, U.data(), V.data(), a.data(), b.data(), ok.data()); });
    double worst = 0;
    for (size_t i = 0; i < n; i++) {
        double r = hypot(a[i], b[i]), h = atan(r), s = h * h, f = h * (1 + s * (e1 + s * (e2 + s * (e3 + s * e4)))) / r;
        worst = std::max(worst, std::max(fabs(f * a[i] - (U[i] - cx) / fx), fabs(f * b[i] - (V[i] - cy) / fy)));
    }
    say("unproject equidistant", t, worst);
#else
    double forward = best(runs, [&] { project(n, X.data(), Y.data(), Z.data(), a.data(), b.data(), ok.data(), 1.2); });
    say("project", forward, 0);
    double t = best(runs, [&] { unproject<2>(n, U.data(), V.data(), a.data(), b.data(), ok.data()); });
    double worst = 0;
    for (size_t i = 0; i < n; i++) {
        double x = a[i], y = b[i], r2 = x * x + y * y, d = 1 + r2 * (k1 + r2 * k2);
        worst = std::max(worst, std::max(fabs(x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) - (U[i] - cx) / fx), fabs(y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y - (V[i] - cy) / fy)));
    }
    say("unproject", t, worst);
    say("sum", forward + t, worst);
#endif
}
