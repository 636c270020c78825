#include "framework/interpolant.hpp"

#include <atomic>
#include <cstring>

#include "framework/interpolant_binding.hpp"
#include "framework/kernels/formulas.hpp"

namespace halfgrad {

namespace {

// The recipe of a rule on simplices and the factors that its lines carry: of the gradient, and of the Hessian's
// diagonal (other entries count twice).
struct FastRule {
  kernels::Recipe recipe;
  double gradient = 0, hessian = 0;
};

FastRule fast_rule(const InterpolationRule& rule) {
  switch (rule.formula) {
    case Formula::hermite:
      return {kernels::Recipe::hermite, 1.0 / 2};
    case Formula::dual_taylor:
      return {kernels::Recipe::dual_taylor, 2.0 / 3, 1.0 / 6};
    case Formula::quadratic10:
      return {kernels::Recipe::quadratic, 1.0 / 2};
    case Formula::blend:
      break;
  }
  return {rule.needs_gradients() ? kernels::Recipe::quadratic : kernels::Recipe::linear, rule.alpha};
}

template <class Scalar>
std::array<Scalar, 9> line_scale(const FastRule& rule, int gdim) {
  std::array<Scalar, 9> scale{};
  for (int k = 0; k < gdim; ++k) scale[k] = static_cast<Scalar>(rule.gradient);
  if (rule.recipe == kernels::Recipe::dual_taylor)
    for (int k = 0, entry = gdim; k < gdim; ++k)
      for (int l = k; l < gdim; ++l, ++entry) scale[entry] = static_cast<Scalar>((k == l ? 1 : 2) * rule.hessian);
  return scale;
}

// Lines of the active vertices from gradients that were computed elsewhere.
template <class Scalar>
void pack_lines(const Scalar* positions, const Values<Scalar>& gradients, const Values<Scalar>* hessians, int columns,
                int gdim, const std::array<Scalar, 9>& scale, Scalar* lines) {
  const int symmetric = hessians != nullptr ? num_symmetric(gdim) : 0, length = 4 * (1 + gdim + symmetric);
  const Offset count = gradients.rows();
  parallel_for(count, vertex_grain(count), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t v = begin; v < end; ++v) {
      Scalar* line = lines + v * length;
      std::fill(std::copy_n(positions + 4 * v, 4, line), line + length, Scalar(0));
      for (int c = 0; c < columns; ++c) {
        for (int k = 0; k < gdim; ++k) line[4 * (1 + k) + c] = scale[k] * gradients(v, c * gdim + k);
        for (int k = 0; k < symmetric; ++k)
          line[4 * (1 + gdim + k) + c] = scale[gdim + k] * (*hessians)(v, c * symmetric + k);
      }
    }
  });
}

// `out` is that of the first point of all blocks.
template <class Runs, class Scalar>
kernels::PointStage<Scalar> point_stage(const Runs& runs, Eigen::Index columns, kernels::Recipe recipe,
                                        const Scalar* lines, double tolerance, Scalar* out) {
  return {.num_columns = static_cast<int>(columns),
          .recipe = recipe,
          .nodes = runs.nodes.data()->data(),
          .rest = runs.rest.data()->data()->data(),
          .first = runs.first.data(),
          .local = runs.local.data(),
          .edges = runs.edges.view(),
          .extrapolates = runs.extrapolates.empty() ? nullptr : runs.extrapolates.data(),
          .affine = runs.affine.data(),
          .lines = lines,
          .tolerance = static_cast<Scalar>(tolerance),
          .out = out + static_cast<Offset>(runs.base) * columns};
}

// Calls f(begin, end) for each range of consecutive items in [begin, end) that are chosen.
template <class Chosen, class Function>
void for_each_chosen_range(Index begin, Index end, Chosen&& chosen, Function&& f) {
  while (begin < end) {
    while (begin < end && !chosen(begin)) ++begin;
    const Index first = begin;
    while (begin < end && chosen(begin)) ++begin;
    if (first < begin) f(first, begin);
  }
}

}  // namespace

template <class Scalar>
Interpolant<Scalar>::~Interpolant() = default;
template <class Scalar>
Interpolant<Scalar>::Interpolant(Interpolant&&) noexcept = default;
template <class Scalar>
Interpolant<Scalar>& Interpolant<Scalar>::operator=(Interpolant&&) noexcept = default;

template <class Scalar>
Index Interpolant<Scalar>::num_points() const {
  return binding_->report.num_points;
}
template <class Scalar>
Index Interpolant<Scalar>::num_vertices() const {
  return binding_->report.num_vertices;
}
template <class Scalar>
int Interpolant<Scalar>::gdim() const {
  return binding_->gdim;
}
template <class Scalar>
const InterpolationRule& Interpolant<Scalar>::rule() const {
  return binding_->rule;
}
template <class Scalar>
const BindReport& Interpolant<Scalar>::report() const {
  return binding_->report;
}
template <class Scalar>
std::span<const Index> Interpolant<Scalar>::active() const {
  return std::span(binding_->vertices).first(static_cast<std::size_t>(binding_->num_active));
}
template <class Scalar>
std::span<const Index> Interpolant<Scalar>::permutation() const {
  return binding_->permutation;
}

template <class Scalar>
template <int fixed_columns, class E>
void Interpolant<Scalar>::Binding::plain_point_stage(const Runs<E>& runs, Index begin, Index end,
                                                     const Values<Scalar>& values, const Values<Scalar>& gradients,
                                                     const Values<Scalar>& hessians, double tolerance,
                                                     Scalar* out) const {
  constexpr int n = E::num_nodes, d = E::dim, sym = num_symmetric(d);
  const int columns = fixed_columns > 0 ? fixed_columns : static_cast<int>(values.cols());
  InterpolationRule linear;
  linear.alpha = 0;
  for (Index run = begin; run < end; ++run) {
    const bool flat = rule.needs_gradients() && is_linear<E>(runs, run, gradients, columns, tolerance);
    const InterpolationRule& used = flat ? linear : rule;
    const bool with_gradients = used.needs_gradients();
    const bool with_hessians = used.needs_hessians();
    std::array<const Scalar*, n> x, gradient{}, hessian{};
    for (int i = 0; i < n; ++i) {
      const Offset node = runs.nodes[run][i];
      x[i] = values.data() + static_cast<Offset>(vertices[node]) * columns;
      if (with_gradients) gradient[i] = gradients.data() + node * columns * d;
      if (with_hessians) hessian[i] = hessians.data() + node * columns * sym;
    }
    for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
      const NodeVector<E> weights_of_point = runs.beta(p);
      std::array<Scalar, n> b;
      for (int i = 0; i < n; ++i) b[i] = static_cast<Scalar>(weights_of_point[i]);
      const auto coefficients = kernels::point_coefficients<Scalar, Scalar, n, d>(used, b, runs.rest[run]);
      Scalar* result = out + static_cast<Offset>(runs.base + p) * columns;
      for (int c = 0; c < columns; ++c) {
        // Differences to the first node: the digits of values far from zero stay out of the sum.
        Scalar sum = 0;
        for (int i = 1; i < n; ++i) sum += coefficients.a[i] * (x[i][c] - x[0][c]);
        if (with_gradients)
          for (int i = 0; i < n; ++i)
            for (int k = 0; k < d; ++k) sum += gradient[i][c * d + k] * coefficients.c[i][k];
        if (with_hessians)
          for (int i = 0; i < n; ++i)
            for (int k = 0; k < sym; ++k) sum += hessian[i][c * sym + k] * coefficients.q[i][k];
        result[c] = x[0][c] + sum;
      }
    }
  }
}

template <class Scalar>
void Interpolant<Scalar>::Binding::frame(const Values<Scalar>& values, const Values<Scalar>* gradients,
                                         const Values<Scalar>* hessians, const EvaluateOptions& options,
                                         Workspace<Scalar>& workspace, Scalar* out) const {
  const FastRule fast = fast_rule(rule);
  workspace.holds = nullptr;
  const auto is_fast = [&]<class E>(const Runs<E>&) {
    return kernels::has_fast_path<E> && options.kernel == Kernel::fast && is_fast_width(values.cols());
  };
  // Where a point lies outside a cell that is no simplex, its value is not the cell's polynomial.
  const auto has_plain_runs = [&]<class E>(const Runs<E>& runs) {
    return !is_fast(runs) || (!E::affine && !runs.extrapolates.empty());
  };
  const bool any_weighted = weighted.num_points() > 0;
  const bool weighted_fast = any_weighted && options.kernel == Kernel::fast && is_fast_width(values.cols()) &&
                             gdim <= kernels::max_simplex_dim;
  bool any_fast = weighted_fast, any_plain = any_weighted && !weighted_fast;
  for (const AnyRuns& any : blocks)
    std::visit(
        [&](const auto& runs) {
          any_fast |= is_fast(runs);
          any_plain |= has_plain_runs(runs);
        },
        any);

  // Gradients for the plain path.
  if (rule.needs_gradients() && gradients == nullptr && any_plain) {
    vertex_derivatives(values, options.kernel, workspace, workspace.gradients, workspace.hessians);
    gradients = &workspace.gradients;
    hessians = rule.needs_hessians() ? &workspace.hessians : nullptr;
  }

  const Scalar* lines = nullptr;
  const int num_weights = kernels::num_weights(fast.recipe, gdim);
  if (any_fast) {
    const bool from_stencils = num_weights > 0 && gradients == nullptr;
    const Scalar* const positions =
        pack_positions(values, from_stencils ? static_cast<Offset>(vertices.size()) : num_active, workspace);
    lines = positions;
    if (num_weights > 0) {
      Scalar* target = reserve<Scalar>(workspace.lines, static_cast<Offset>(num_active) * 4 * (1 + num_weights));
      lines = target;
      auto scale = line_scale<Scalar>(fast, gdim);
      if (any_weighted) scale.fill(1);  // the coefficients of points have the rule's factors
      if (from_stencils) {
        vertex_lines(positions, scale, workspace, target);
      } else {
        pack_lines(positions, *gradients, hessians, static_cast<int>(values.cols()), gdim, scale, target);
      }
    }
  }

  const Values<Scalar> none;
  for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    const auto plain = [&](Index first, Index last) {
      with_columns(values.cols(), [&](auto columns) {
        plain_point_stage<columns()>(runs, first, last, values, gradients != nullptr ? *gradients : none,
                                     hessians != nullptr ? *hessians : none, options.tolerance, out);
      });
    };
    if (!is_fast(runs)) return plain(begin, end);
    const auto stage = point_stage(runs, values.cols(), fast.recipe, lines, options.tolerance, out);
    stage.template run<E>(begin, end);
    if (!has_plain_runs(runs)) return;
    for (Index run = begin; run < end; ++run)
      if (runs.extrapolates[run]) plain(run, run + 1);
  });
  if (weighted_fast)
    weighted_point_stage(static_cast<int>(values.cols()), lines, out);
  else if (any_weighted)
    plain_weighted_stage(values, gradients != nullptr ? *gradients : none, hessians != nullptr ? *hessians : none, out);
  std::fill(out + static_cast<Offset>(num_served) * values.cols(),
            out + static_cast<Offset>(report.num_points) * values.cols(), std::numeric_limits<Scalar>::quiet_NaN());
}

template <class Scalar>
bool Interpolant<Scalar>::Binding::all_fast(Eigen::Index columns, Kernel kernel) const {
  if (blended || weighted.num_points() > 0 || kernel != Kernel::fast || !is_fast_width(columns)) return false;
  return std::all_of(blocks.begin(), blocks.end(), [&](const AnyRuns& any) {
    return std::visit(
        [&]<class E>(const Runs<E>& runs) {
          return kernels::has_fast_path<E> && (E::affine || runs.extrapolates.empty());
        },
        any);
  });
}

template <class Scalar>
Index Interpolant<Scalar>::Binding::update(const Values<Scalar>& values, const EvaluateOptions& options,
                                           Workspace<Scalar>& workspace, Scalar* out) const {
  const FastRule fast = fast_rule(rule);
  const int num_weights = kernels::num_weights(fast.recipe, gdim);
  const auto count = num_weights > 0 ? static_cast<Offset>(vertices.size()) : num_active;
  auto* const positions = reinterpret_cast<Scalar*>(workspace.positions.data());
  std::vector<std::uint8_t>& moved = workspace.moved;
  moved.assign(static_cast<std::size_t>(count + num_active), 0);
  const auto columns = static_cast<std::size_t>(values.cols());
  std::atomic<bool> any_moved = false;
  parallel_for(count, vertex_grain(count), [&](std::int64_t begin, std::int64_t end) {
    bool any = false;
    for (std::int64_t v = begin; v < end; ++v) {
      const Scalar* from = values.data() + static_cast<Offset>(vertices[v]) * values.cols();
      if (std::memcmp(positions + 4 * v, from, columns * sizeof(Scalar)) == 0) continue;
      std::copy_n(from, columns, positions + 4 * v);
      moved[v] = 1;
      any = true;
    }
    if (any) any_moved = true;
  });
  if (!any_moved) return 0;

  // Lines depend on the stencils' vertices too.
  const std::uint8_t* changed = moved.data();
  const Scalar* lines = positions;
  if (num_weights > 0) {
    auto* const target = reinterpret_cast<Scalar*>(workspace.lines.data());
    lines = target;
    std::uint8_t* const stale = moved.data() + count;
    changed = stale;
    const auto stage = vertex_stage(stencils, line_scale<Scalar>(fast, gdim), positions, target);
    parallel_for(num_active, vertex_grain(num_active), [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t r = begin; r < end; ++r) {
        std::uint8_t any = moved[r];
        for (Offset e = stencils.begin(r); e < stencils.end(r); ++e) any |= moved[stencils.neighbors[e]];
        stale[r] = any;
      }
      for_each_chosen_range(
          static_cast<Index>(begin), static_cast<Index>(end), [&](Index r) { return stale[r] != 0; },
          [&](Index first, Index last) { stage.run(first, last); });
    });
  }

  std::atomic<Index> num_evaluated = 0;
  for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    const auto stage = point_stage(runs, values.cols(), fast.recipe, lines, options.tolerance, out);
    const auto is_stale = [&](Index run) {
      return std::any_of(runs.nodes[run].begin(), runs.nodes[run].end(),
                         [&](Index node) { return changed[node] != 0; });
    };
    // One range a window, from its first stale run to its last: the work that runs of a window share is done once.
    for (; begin < end; begin += kernels::window_size) {
      Index first = begin, last = std::min(begin + kernels::window_size, end), num_stale = 0;
      while (first < last && !is_stale(first)) ++first;
      while (first < last && !is_stale(last - 1)) --last;
      if (first == last) continue;
      stage.template run<E>(first, last);
      for (Index run = first; run < last; ++run) num_stale += is_stale(run);
      num_evaluated += num_stale;
    }
  });
  return num_evaluated;
}

template <class Scalar>
void Interpolant<Scalar>::Binding::to_caller_order(const Values<Scalar>& sorted, Values<Scalar>& out) const {
  const Offset num_points = sorted.rows();
  parallel_for(num_points, num_points < parallel_threshold ? num_points : points_per_task,
               [&](std::int64_t begin, std::int64_t end) {
                 with_columns(sorted.cols(), [&](auto fixed) {
                   const Offset columns = fixed() > 0 ? fixed() : sorted.cols();
                   // Far enough ahead for a row to arrive from memory.
                   constexpr Offset ahead = 24;
                   const Offset prefetch_end = std::min<Offset>(end, num_points - ahead);
                   for (Offset p = begin; p < end; ++p) {
                     if (p < prefetch_end) __builtin_prefetch(sorted.data() + position[p + ahead] * columns);
                     const Scalar* from = sorted.data() + position[p] * columns;
                     for (Offset c = 0; c < columns; ++c) out.data()[p * columns + c] = from[c];
                   }
                 });
               });
}

template <class Scalar>
void Interpolant<Scalar>::evaluate_given(const Values<Scalar>& values, const Values<Scalar>& gradients,
                                         const Values<Scalar>& hessians, Values<Scalar>& out,
                                         const EvaluateOptions& options) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  const auto require = [&](const Values<Scalar>& given, Eigen::Index columns, const char* what) {
    if (given.rows() != binding.num_active || given.cols() != columns)
      raise("{} of {} × {}: expected {} active vertices × {}", what, given.rows(), given.cols(), binding.num_active,
            columns);
  };
  const bool with_gradients = binding.rule.needs_gradients(), with_hessians = binding.rule.needs_hessians();
  if (with_gradients) require(gradients, values.cols() * binding.gdim, "gradients");
  if (with_hessians) require(hessians, values.cols() * num_symmetric(binding.gdim), "hessians");
  Workspace<Scalar> workspace;
  Values<Scalar> sorted(num_points(), values.cols());
  binding.frame(values, with_gradients ? &gradients : nullptr, with_hessians ? &hessians : nullptr, options, workspace,
                sorted.data());
  if (binding.position.empty()) {
    out = std::move(sorted);
  } else {
    out.resize(num_points(), values.cols());
    binding.to_caller_order(sorted, out);
  }
}

template <class Scalar>
void Interpolant<Scalar>::evaluate_sorted(const Values<Scalar>& values, Values<Scalar>& out,
                                          Workspace<Scalar>& workspace, const EvaluateOptions& options) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  if (binding.rule.needs_gradients()) binding.require_gradients();
  if (out.rows() != num_points() || out.cols() != values.cols()) {
    out.resize(num_points(), values.cols());
    use_large_pages(out.data(), static_cast<std::size_t>(out.size()) * sizeof(Scalar));
  }
  binding.frame(values, nullptr, nullptr, options, workspace, out.data());
}

template <class Scalar>
Index Interpolant<Scalar>::update_sorted(const Values<Scalar>& values, Values<Scalar>& out,
                                         Workspace<Scalar>& workspace, const EvaluateOptions& options) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  if (workspace.holds == &binding && workspace.held_columns == values.cols() &&
      workspace.held_tolerance == options.tolerance && options.kernel == Kernel::fast && out.rows() == num_points() &&
      out.cols() == values.cols())
    return binding.update(values, options, workspace, out.data());
  evaluate_sorted(values, out, workspace, options);
  if (binding.all_fast(values.cols(), options.kernel)) {
    workspace.holds = &binding;
    workspace.held_columns = values.cols();
    workspace.held_tolerance = options.tolerance;
  }
  return report().num_active_cells;
}

template <class Scalar>
void Interpolant<Scalar>::evaluate(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                                   const EvaluateOptions& options) const {
  if (binding_->position.empty()) {
    evaluate_sorted(values, out, workspace, options);
    return;
  }
  evaluate_sorted(values, workspace.sorted, workspace, options);
  out.resize(num_points(), values.cols());
  binding_->to_caller_order(workspace.sorted, out);
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::evaluate(const Values<Scalar>& values, const EvaluateOptions& options) const {
  Values<Scalar> out;
  Workspace<Scalar> workspace;
  evaluate(values, out, workspace, options);
  return out;
}

template <class Scalar>
Index Interpolant<Scalar>::num_linear_cells(const Values<Scalar>& values, const EvaluateOptions& options) const {
  if (!binding_->rule.needs_gradients()) return report().num_active_cells;
  const Values<Scalar> gradients = vertex_gradients(values);
  Index count = 0;
  for (const auto& any : binding_->blocks)
    std::visit(
        [&]<class AnyElementRuns>(const AnyElementRuns& runs) {
          using E = typename AnyElementRuns::element;
          for (Index run = 0; run < runs.num_runs(); ++run)
            count += binding_->template is_linear<E>(runs, run, gradients, values.cols(), options.tolerance);
        },
        any);
  return count;
}

template class Interpolant<float>;
template class Interpolant<double>;

}  // namespace halfgrad
