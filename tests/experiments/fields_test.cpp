// Derivatives of the analytic fields, and the facts that their formulas promise.
#include "experiments/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>

#include <nlohmann/json.hpp>

#include "experiments/random.hpp"
#include "framework/error.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;
using testing::HasSubstr;

struct FieldCase {
  std::string name;
  int gdim;
};

std::vector<FieldCase> all_cases() {
  std::vector<FieldCase> cases;
  for (const FieldEntry& entry : field_registry())
    for (int gdim : {2, 3})
      if (gdim == 3 || entry.name != "kelvinlet_pinch") cases.push_back({std::string(entry.name), gdim});
  return cases;
}

class AnyField : public testing::TestWithParam<FieldCase> {};

TEST_P(AnyField, DerivativesAreThoseOfTheValue) {
  const auto& [name, gdim] = GetParam();
  const auto field = make_field(json(name), "/field", {gdim, 3});
  RandomStream random(1, 0);
  // Central differences: truncation ~ step² f''' and round-off ~ 1e-16 / step, both below the bounds.
  constexpr double step = 1e-5;
  for (int n = 0; n < 40; ++n) {
    Vector at(gdim);
    for (int a = 0; a < gdim; ++a) at[a] = random.uniform(-0.6, 0.6);
    const FieldJet jet = field->jet(at);
    EXPECT_LT((jet.value - field->value(at)).norm(), 1e-14 * (1 + jet.value.norm()));
    for (int a = 0; a < gdim; ++a) {
      Vector plus = at, minus = at;
      plus[a] += step;
      minus[a] -= step;
      const Vector slope = (field->value(plus) - field->value(minus)) / (2 * step);
      EXPECT_LT((jet.gradient.col(a) - slope).norm(), 1e-7);
      const SmallMatrix curvature = (field->jet(plus).gradient - field->jet(minus).gradient) / (2 * step);
      for (int c = 0; c < gdim; ++c) EXPECT_LT((jet.hessian[c].col(a).transpose() - curvature.row(c)).norm(), 1e-6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Registry, AnyField, testing::ValuesIn(all_cases()),
                         [](const auto& test) { return test.param.name + "_" + std::to_string(test.param.gdim); });

TEST(KelvinletPinch, IsIncompressibleToFirstOrderAndInjective) {
  const auto field = make_field("kelvinlet_pinch", "/field", {3, 0});
  RandomStream random(2, 0);
  for (int n = 0; n < 200; ++n) {
    Vector at(3);
    for (int a = 0; a < 3; ++a) at[a] = random.uniform(-0.5, 0.5);
    const FieldJet jet = field->jet(at);
    EXPECT_NEAR(jet.gradient.trace(), 3, 1e-13);  // div u = 0
    EXPECT_GT(Eigen::Matrix3d(jet.gradient).determinant(), 0.1);
  }
}

TEST(KelvinletPinch, GradientAtTheCenterIsTheStrength) {
  const auto field = make_field(json::parse(R"({"kelvinlet_pinch": {"strength": 0.4}})"), "/field", {3, 0});
  const Eigen::Matrix3d gradient = field->jet(Vector::Zero(3)).gradient;
  const Eigen::Matrix3d expected = Eigen::Vector3d(0.6, 1.4, 1).asDiagonal();
  EXPECT_LT((gradient - expected).norm(), 1e-14);
}

TEST(BendTwist, KeepsTheAxisOnACircle) {
  const auto field = make_field("bend_twist", "/field", {3, 0});
  for (double z : {-0.5, 0.1, 0.5}) {
    const Vector x = field->value(Eigen::Vector3d(0, 0, z));
    EXPECT_NEAR(std::hypot(x[0] + 1.2, x[2]), 1.2, 1e-14);
    EXPECT_NEAR(x[1], 0, 1e-15);
  }
}

TEST(RadialTwist, KeepsTheDistanceFromItsCenter) {
  const auto field = make_field("radial_twist", "/field", {2, 0});
  EXPECT_NEAR(field->value(Eigen::Vector2d(0.3, -0.4)).norm(), 0.5, 1e-15);
}

TEST(Fields, PolynomialTakesGivenCoefficients) {
  // Order 1, x, y, x², xy, y²: f = (x² , xy).
  const auto field = make_field(
      json::parse(R"({"polynomial": {"degree": 2, "coefficients": [0,0,0,1,0,0, 0,0,0,0,1,0]}})"), "/field", {2, 0});
  const Vector x = field->value(Eigen::Vector2d(3, 5));
  EXPECT_DOUBLE_EQ(x[0], 9);
  EXPECT_DOUBLE_EQ(x[1], 15);
}

TEST(Fields, RefusesUnknownNamesAndKeys) {
  const auto message = [](const char* text, int gdim) -> std::string {
    try {
      make_field(json::parse(text), "/field", {gdim, 0});
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message(R"("bend_twst")", 3), HasSubstr("did you mean \"bend_twist\""));
  EXPECT_THAT(message(R"({"bend_twist": {"angel": 1}})", 3), HasSubstr("/field/bend_twist/angel"));
  EXPECT_THAT(message(R"({"kelvinlet_pinch": {"pinch": [1,0,0,0,1,0,0,0,1]}})", 3), HasSubstr("trace zero"));
  EXPECT_THAT(message(R"("kelvinlet_pinch")", 2), HasSubstr("dimension 2"));
}

}  // namespace
}  // namespace halfgrad
