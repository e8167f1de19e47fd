// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cctype>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace subvol_tests {

/// Reads the part of USD's text format that one Mesh prim needs, strictly: what it does not know it refuses.
///
///   #usda 1.0 ( key = value ... ) def Mesh "name" { [uniform] type[[]] name = value ... }
///
/// Types are checked against the Mesh schema; arrays of tuples are flattened, every tuple of three numbers.
class UsdaFile {
 public:
  std::map<std::string, std::string> stage;
  std::string prim;

  explicit UsdaFile(const std::string& text) : rest_(text) {
    expect("#usda 1.0\n");
    expect("(");
    while (!accept(")")) {
      const std::string key = word();
      expect("=");
      stage[key] = peek() == '"' ? quoted() : word();
    }
    expect("def");
    expect("Mesh");
    prim = quoted();
    expect("{");
    while (!accept("}")) attribute();
    skip();
    if (!rest_.empty()) fail("text after the prim");
  }

  const std::vector<double>& numbers(const std::string& name) const { return arrays_.at(name); }
  const std::string& token(const std::string& name) const { return tokens_.at(name); }

 private:
  static const std::map<std::string, std::string>& schema() {
    static const std::map<std::string, std::string> types{{"extent", "float3[]"},
                                                          {"points", "point3f[]"},
                                                          {"faceVertexCounts", "int[]"},
                                                          {"faceVertexIndices", "int[]"},
                                                          {"creaseIndices", "int[]"},
                                                          {"creaseLengths", "int[]"},
                                                          {"creaseSharpnesses", "float[]"},
                                                          {"cornerIndices", "int[]"},
                                                          {"cornerSharpnesses", "float[]"},
                                                          {"subdivisionScheme", "uniform token"},
                                                          {"orientation", "uniform token"},
                                                          {"interpolateBoundary", "token"},
                                                          {"triangleSubdivisionRule", "token"}};
    return types;
  }

  void attribute() {
    std::string type = word();
    if (type == "uniform") type += " " + word();
    const bool is_array = accept("[");
    if (is_array) {
      expect("]");
      type += "[]";
    }
    const std::string name = word();
    expect("=");
    const auto known = schema().find(name);
    if (known == schema().end() || known->second != type) fail(name + " is no " + type);
    if (arrays_.contains(name) || tokens_.contains(name)) fail(name + " stands twice");
    if (!is_array)
      tokens_[name] = quoted();
    else
      arrays_[name] = array(type == "float3[]" || type == "point3f[]", type == "int[]");
  }

  std::vector<double> array(bool tuples, bool integers) {
    std::vector<double> values;
    expect("[");
    if (accept("]")) return values;
    do {
      if (tuples) expect("(");
      for (int k = 0; k < (tuples ? 3 : 1); ++k) {
        if (k > 0) expect(",");
        values.push_back(number(integers));
      }
      if (tuples) expect(")");
    } while (accept(","));
    expect("]");
    return values;
  }

  double number(bool integer) {
    const std::string text = word();
    std::size_t used = 0;
    const double value = integer ? std::stoi(text, &used) : std::stod(text, &used);
    if (used != text.size()) fail(text + " is no number");
    return value;
  }

  std::string word() {
    skip();
    std::size_t n = 0;
    while (n < rest_.size() && (std::isalnum(static_cast<unsigned char>(rest_[n])) ||
                                std::string_view("_:+-.").find(rest_[n]) != std::string_view::npos))
      ++n;
    if (n == 0) fail("expected a word");
    return take(n);
  }
  std::string quoted() {
    expect("\"");
    const std::size_t n = rest_.find('"');
    if (n == std::string_view::npos) fail("unended string");
    std::string text = take(n);
    expect("\"");
    return text;
  }

  void skip() {
    while (!rest_.empty() && std::isspace(static_cast<unsigned char>(rest_[0]))) rest_.remove_prefix(1);
  }
  char peek() {
    skip();
    return rest_.empty() ? '\0' : rest_[0];
  }
  bool accept(std::string_view what) {
    skip();
    if (!rest_.starts_with(what)) return false;
    rest_.remove_prefix(what.size());
    return true;
  }
  void expect(std::string_view what) {
    if (!accept(what)) fail("expected " + std::string(what));
  }
  std::string take(std::size_t n) {
    std::string text(rest_.substr(0, n));
    rest_.remove_prefix(n);
    return text;
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error("usda: " + why + " before \"" + std::string(rest_.substr(0, 40)) + "\"");
  }

  std::string_view rest_;
  std::map<std::string, std::vector<double>> arrays_;
  std::map<std::string, std::string> tokens_;
};

}  // namespace subvol_tests
