#include "experiments/fields.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "experiments/jet.hpp"
#include "experiments/random.hpp"
#include "framework/error.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

/// A position or value in D dimensions over any scalar.
template <class T, int D>
using Tuple = std::array<T, D>;

/// A field from one formula: Formula::operator()(const Tuple<T, D>&) over T = double and T = Jet<D>.
template <class Formula, int D>
class FormulaField final : public Field {
 public:
  explicit FormulaField(Formula formula) : formula_(std::move(formula)) {}

  Vector value(const Vector& position) const override {
    Tuple<double, D> at;
    for (int a = 0; a < D; ++a) at[a] = position[a];
    const Tuple<double, D> x = formula_(at);
    return Eigen::Map<const Eigen::Matrix<double, D, 1>>(x.data());
  }

  FieldJet jet(const Vector& position) const override {
    Tuple<Jet<D>, D> at;
    for (int a = 0; a < D; ++a) at[a] = Jet<D>::variable(position[a], a);
    const Tuple<Jet<D>, D> x = formula_(at);
    FieldJet result;
    result.value.resize(D);
    result.gradient.resize(D, D);
    for (int c = 0; c < D; ++c) {
      result.value[c] = x[c].value;
      result.gradient.row(c) = x[c].gradient.transpose();
      result.hessian[c] = x[c].hessian;
    }
    return result;
  }

 private:
  Formula formula_;
};

/// make.operator()<D>() for the dimension at hand.
template <class Make>
std::unique_ptr<Field> in_each_dimension(int gdim, Make&& make) {
  if (gdim == 3) return make.template operator()<3>();
  if (gdim == 2) return make.template operator()<2>();
  return make.template operator()<1>();
}

void need_plane_or_space(const JsonReader& options, int gdim) {
  if (gdim < 2) raise("{}: a field of the plane or space, but the mesh is a line", options.pointer());
}

/// An array of `length` numbers under a key, or the default.
std::vector<double> numbers(JsonReader& options, std::string_view key, std::vector<double> fallback) {
  const json* value = options.find(key);
  if (value == nullptr) {
    options.record(key, fallback);
    return fallback;
  }
  const auto is_number = [](const json& entry) { return entry.is_number(); };
  if (!value->is_array() || value->size() != fallback.size() || !std::all_of(value->begin(), value->end(), is_number))
    raise("{}: found {}, expected an array of {} numbers", options.pointer_to(key), value->dump(), fallback.size());
  return value->get<std::vector<double>>();
}

template <int D>
Tuple<double, D> center_of(JsonReader& options, std::vector<double> fallback = std::vector<double>(D, 0.0)) {
  const std::vector<double> center = numbers(options, "center", std::move(fallback));
  Tuple<double, D> result{};
  std::copy(center.begin(), center.end(), result.begin());
  return result;
}

/// x = A X + b.
template <int D>
struct Affine {
  Eigen::Matrix<double, D, D> matrix;
  Eigen::Matrix<double, D, 1> offset;
  template <class T>
  Tuple<T, D> operator()(const Tuple<T, D>& X) const {
    Tuple<T, D> x;
    for (int c = 0; c < D; ++c) {
      x[c] = offset[c];
      for (int a = 0; a < D; ++a) x[c] += matrix(c, a) * X[a];
    }
    return x;
  }
};

template <int D>
std::unique_ptr<Field> make_affine_in(JsonReader& options, const FieldSetting& setting) {
  RandomStream random(setting.seed, 11);
  std::vector<double> matrix(D * D), offset(D);
  for (int c = 0; c < D; ++c) {
    for (int a = 0; a < D; ++a) matrix[c * D + a] = (c == a ? 1 : 0) + random.uniform(-0.4, 0.4);
    offset[c] = random.uniform(-1, 1);
  }
  matrix = numbers(options, "matrix", matrix);
  offset = numbers(options, "offset", offset);
  Affine<D> field;
  field.matrix = Eigen::Map<const Eigen::Matrix<double, D, D, Eigen::RowMajor>>(matrix.data());
  field.offset = Eigen::Map<const Eigen::Matrix<double, D, 1>>(offset.data());
  return std::make_unique<FormulaField<Affine<D>, D>>(field);
}

std::unique_ptr<Field> make_affine(JsonReader& options, const FieldSetting& setting) {
  return in_each_dimension(setting.gdim, [&]<int D>() { return make_affine_in<D>(options, setting); });
}

/// x = Σ over monomials of total degree ≤ n of coefficient · X^m, one polynomial a component.
template <int D>
struct Polynomial {
  std::vector<std::array<int, D>> powers;
  Eigen::MatrixXd coefficients;  // D × #powers
  int degree = 0;
  template <class T>
  Tuple<T, D> operator()(const Tuple<T, D>& X) const {
    std::vector<std::array<T, D>> power(degree + 1);
    power[0].fill(T(1.0));
    for (int n = 1; n <= degree; ++n)
      for (int a = 0; a < D; ++a) power[n][a] = power[n - 1][a] * X[a];
    Tuple<T, D> x;
    x.fill(T(0.0));
    for (std::size_t m = 0; m < powers.size(); ++m) {
      T monomial = power[powers[m][0]][0];
      for (int a = 1; a < D; ++a) monomial = monomial * power[powers[m][a]][a];
      for (int c = 0; c < D; ++c) x[c] += coefficients(c, static_cast<Eigen::Index>(m)) * monomial;
    }
    return x;
  }
};

template <int D>
std::unique_ptr<Field> make_polynomial_in(JsonReader& options, const FieldSetting& setting) {
  Polynomial<D> field;
  field.degree = small_integer(options, "degree", 2);
  if (field.degree < 0 || field.degree > 8)
    raise("{}: found {}, expected 0 to 8", options.pointer_to("degree"), field.degree);
  // Graded order: all of degree 0, then 1, …; within a degree the first axis' power falls.
  for (int total = 0; total <= field.degree; ++total)
    for (int i = total; i >= 0; --i) {
      if constexpr (D == 1) {
        if (i == total) field.powers.push_back({i});
      } else if constexpr (D == 2) {
        field.powers.push_back({i, total - i});
      } else {
        for (int j = total - i; j >= 0; --j) field.powers.push_back({i, j, total - i - j});
      }
    }
  const int num_powers = static_cast<int>(field.powers.size());
  RandomStream random(setting.seed, 12);
  std::vector<double> coefficients(static_cast<std::size_t>(D) * num_powers);
  for (double& coefficient : coefficients) coefficient = random.uniform(-1, 1);
  coefficients = numbers(options, "coefficients", coefficients);
  field.coefficients =
      Eigen::Map<const Eigen::Matrix<double, D, Eigen::Dynamic, Eigen::RowMajor>>(coefficients.data(), D, num_powers);
  return std::make_unique<FormulaField<Polynomial<D>, D>>(std::move(field));
}

std::unique_ptr<Field> make_polynomial(JsonReader& options, const FieldSetting& setting) {
  return in_each_dimension(setting.gdim, [&]<int D>() { return make_polynomial_in<D>(options, setting); });
}

/// Twist about the third axis by `angle` a unit length, then bend of the third axis to a circle of radius `bend`.
struct BendTwist {
  double angle, bend;
  Tuple<double, 3> center;
  template <class T>
  Tuple<T, 3> operator()(const Tuple<T, 3>& X) const {
    using std::cos;
    using std::sin;
    const T p = X[0] - center[0], q = X[1] - center[1], z = X[2] - center[2];
    const T c = cos(angle * z), s = sin(angle * z);
    const T u = c * p - s * q, v = s * p + c * q;
    const T arm = bend + u;
    return {arm * cos(z / bend) - bend, v, arm * sin(z / bend)};
  }
};

/// The plane's share of it: bend of the second axis to a circle.
struct Bend2 {
  double bend;
  Tuple<double, 2> center;
  template <class T>
  Tuple<T, 2> operator()(const Tuple<T, 2>& X) const {
    using std::cos;
    using std::sin;
    const T u = X[0] - center[0], z = X[1] - center[1];
    const T arm = bend + u;
    return {arm * cos(z / bend) - bend, arm * sin(z / bend)};
  }
};

std::unique_ptr<Field> make_bend_twist(JsonReader& options, const FieldSetting& setting) {
  need_plane_or_space(options, setting.gdim);
  const double bend = options.number("bend_radius", 1.2);
  if (!(bend > 0)) raise("{}: found {}, expected a positive length", options.pointer_to("bend_radius"), bend);
  if (setting.gdim == 2) return std::make_unique<FormulaField<Bend2, 2>>(Bend2{bend, center_of<2>(options)});
  const double angle = options.number("angle", 1.2);
  return std::make_unique<FormulaField<BendTwist, 3>>(BendTwist{angle, bend, center_of<3>(options)});
}

/// Rotation in the plane of the first two axes by angle · sqrt(r² + softening²), r the distance from the axis.
template <int D>
struct RadialTwist {
  double angle, softening;
  Tuple<double, D> center;
  template <class T>
  Tuple<T, D> operator()(const Tuple<T, D>& X) const {
    using std::cos;
    using std::sin;
    using std::sqrt;
    const T p = X[0] - center[0], q = X[1] - center[1];
    const T theta = angle * sqrt(p * p + q * q + softening * softening);
    Tuple<T, D> x = X;
    x[0] = cos(theta) * p - sin(theta) * q;
    x[1] = sin(theta) * p + cos(theta) * q;
    return x;
  }
};

std::unique_ptr<Field> make_radial_twist(JsonReader& options, const FieldSetting& setting) {
  need_plane_or_space(options, setting.gdim);
  const double angle = options.number("angle", 2.2);
  const double softening = options.number("softening", 0.1);
  if (!(softening > 0)) raise("{}: found {}, expected a positive length", options.pointer_to("softening"), softening);
  if (setting.gdim == 2)
    return std::make_unique<FormulaField<RadialTwist<2>, 2>>(RadialTwist<2>{angle, softening, center_of<2>(options)});
  return std::make_unique<FormulaField<RadialTwist<3>, 3>>(RadialTwist<3>{angle, softening, center_of<3>(options)});
}

/// x_a = X_a + amplitude · sin(k (X_b + phase_a)), b the next axis, plus a weaker wave along the diagonal.
template <int D>
struct Waves {
  double amplitude, wavenumber;
  template <class T>
  Tuple<T, D> operator()(const Tuple<T, D>& X) const {
    using std::cos;
    using std::sin;
    T diagonal = X[0];
    for (int a = 1; a < D; ++a) diagonal = diagonal + X[a];
    Tuple<T, D> x;
    for (int a = 0; a < D; ++a)
      x[a] = X[a] + amplitude *
                        (sin(wavenumber * X[(a + 1) % D] + 0.7 * a) + 0.5 * cos(0.6 * wavenumber * diagonal + 1.1 * a));
    return x;
  }
};

std::unique_ptr<Field> make_waves(JsonReader& options, const FieldSetting& setting) {
  const double amplitude = options.number("amplitude", 0.1);
  const double wavenumber = options.number("wavenumber", 5);
  return in_each_dimension(setting.gdim, [&]<int D>() -> std::unique_ptr<Field> {
    return std::make_unique<FormulaField<Waves<D>, D>>(Waves<D>{amplitude, wavenumber});
  });
}

/// De Goes & James 2017, Eq. 17, at Poisson's ratio ½, where 2b = a:
///   u(r) = −(3a / 2 r_ε⁵) [(rᵀ P r) r + ε² P r],  r_ε² = r² + ε²,
/// scaled so that ∇u(0) = −strength · P. Its divergence is zero for any traceless P.
template <int D>
struct KelvinletPinch {
  double epsilon, strength;
  Eigen::Matrix<double, D, D> pinch;
  Tuple<double, D> center;
  template <class T>
  Tuple<T, D> operator()(const Tuple<T, D>& X) const {
    using std::sqrt;
    Tuple<T, D> r, forced;
    T square = T(epsilon * epsilon), along = T(0.0);
    for (int a = 0; a < D; ++a) {
      r[a] = X[a] - center[a];
      square += r[a] * r[a];
    }
    for (int c = 0; c < D; ++c) {
      forced[c] = T(0.0);
      for (int a = 0; a < D; ++a) forced[c] += pinch(c, a) * r[a];
      along += r[c] * forced[c];
    }
    const T scale = strength * epsilon * epsilon * epsilon / (square * square * sqrt(square));
    Tuple<T, D> x;
    for (int c = 0; c < D; ++c) x[c] = X[c] - scale * (along * r[c] + epsilon * epsilon * forced[c]);
    return x;
  }
};

template <int D>
std::unique_ptr<Field> make_kelvinlet_in(JsonReader& options) {
  KelvinletPinch<D> field;
  field.epsilon = options.number("epsilon", 0.35);
  if (!(field.epsilon > 0))
    raise("{}: found {}, expected a positive length", options.pointer_to("epsilon"), field.epsilon);
  field.strength = options.number("strength", 0.6);
  std::vector<double> identity(D * D, 0.0);
  identity[0] = 1;
  identity[D + 1] = -1;
  const std::vector<double> pinch = numbers(options, "pinch", identity);
  field.pinch = Eigen::Map<const Eigen::Matrix<double, D, D, Eigen::RowMajor>>(pinch.data());
  if ((field.pinch - field.pinch.transpose()).norm() > 1e-12 || std::abs(field.pinch.trace()) > 1e-12)
    raise("{}: found {}, expected a symmetric matrix of trace zero, row by row", options.pointer_to("pinch"),
          json(pinch).dump());
  field.center = center_of<D>(options);
  return std::make_unique<FormulaField<KelvinletPinch<D>, D>>(field);
}

std::unique_ptr<Field> make_kelvinlet_pinch(JsonReader& options, const FieldSetting& setting) {
  // The kernel is that of three-dimensional elasticity; in the plane it would not be incompressible.
  if (setting.gdim != 3) raise("{}: a field of space, but the mesh has dimension {}", options.pointer(), setting.gdim);
  return make_kelvinlet_in<3>(options);
}

/// A rotation about `center` on the side of a plane that its normal points to, the identity on the other: continuous at
/// the center (and on the axis) alone, for meshes whose parts meet there.
class RigidParts final : public Field {
 public:
  RigidParts(Vector center, Vector normal, SmallMatrix rotation)
      : center_(std::move(center)), normal_(std::move(normal)), rotation_(std::move(rotation)) {}

  Vector value(const Vector& position) const override { return center_ + gradient(position) * (position - center_); }
  FieldJet jet(const Vector& position) const override {
    const auto gdim = center_.size();
    FieldJet result{value(position), gradient(position), {}};
    for (Eigen::Index c = 0; c < gdim; ++c) result.hessian[c] = SmallMatrix::Zero(gdim, gdim);
    return result;
  }

 private:
  SmallMatrix gradient(const Vector& position) const {
    if (normal_.dot(position - center_) > 0) return rotation_;
    return SmallMatrix::Identity(center_.size(), center_.size());
  }

  Vector center_, normal_;
  SmallMatrix rotation_;
};

std::unique_ptr<Field> make_rigid_parts(JsonReader& options, const FieldSetting& setting) {
  need_plane_or_space(options, setting.gdim);
  const int gdim = setting.gdim;
  const auto vector = [&](std::string_view key, std::vector<double> fallback) -> Vector {
    const std::vector<double> entries = numbers(options, key, std::move(fallback));
    return Eigen::Map<const Eigen::VectorXd>(entries.data(), gdim);
  };
  std::vector<double> zero(gdim, 0.0), last = zero;
  last.back() = 1;
  const double angle = options.number("angle", 1.5707963267948966);
  const Vector center = vector("center", zero), normal = vector("normal", last);
  SmallMatrix rotation = SmallMatrix::Identity(gdim, gdim);
  if (gdim == 2) {
    rotation << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  } else {
    const Eigen::Vector3d axis = vector("axis", last).head<3>();
    if (!(axis.norm() > 0)) raise("{}: expected a vector that is not zero", options.pointer_to("axis"));
    rotation = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  }
  return std::make_unique<RigidParts>(center, normal, rotation);
}

}  // namespace

std::span<const FieldEntry> field_registry() {
  static const std::array entries = {
      FieldEntry{"affine", "x = A X + b", make_affine},
      FieldEntry{"polynomial", "random or given coefficients up to a total degree", make_polynomial},
      FieldEntry{"bend_twist", "twist about the last axis, then bend of that axis to a circle", make_bend_twist},
      FieldEntry{"radial_twist", "rotation in the plane by an angle that grows with the radius", make_radial_twist},
      FieldEntry{"waves", "sine waves along and across the axes", make_waves},
      FieldEntry{"kelvinlet_pinch", "incompressible regularized pinch, De Goes & James 2017, Eq. 17",
                 make_kelvinlet_pinch},
      FieldEntry{"rigid_parts", "a rotation on one side of a plane, identity on the other", make_rigid_parts},
  };
  return entries;
}

std::unique_ptr<Field> make_field(const json& specification, const std::string& pointer, const FieldSetting& setting,
                                  json* resolved) {
  std::vector<std::string_view> names;
  for (const FieldEntry& entry : field_registry()) names.push_back(entry.name);
  const NamedOptions chosen = read_named_options(specification, pointer, "field", names);
  const auto entry = std::ranges::find(field_registry(), chosen.name, &FieldEntry::name);
  JsonReader reader(*chosen.options, chosen.pointer);
  std::unique_ptr<Field> field = entry->make(reader, setting);
  reader.finish();
  if (resolved != nullptr) *resolved = json{{chosen.name, reader.resolved()}};
  return field;
}

Points field_values(const Field& field, const Points& positions) {
  Points values(positions.rows(), positions.cols());
  for (Eigen::Index i = 0; i < positions.rows(); ++i) values.row(i) = field.value(positions.row(i).transpose());
  return values;
}

}  // namespace halfgrad
