// The forces of a description compiled for one space and scalar.
#pragma once

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "mechanism/model/force_joint.h"
#include "mechanism/model/force_other.h"
#include "mechanism/model/force_point.h"
#include "mechanism/model/force_spring.h"

namespace loopbench {

/// A force of any kind.
template <class Space, class S, class Descriptions = ForceDescription>
struct AnyForceElement;
template <class Space, class S, class... Descriptions>
struct AnyForceElement<Space, S, std::variant<Descriptions...>> {
  using Type = std::variant<ForceElement<Space, S, Descriptions>...>;
};

/// All forces of a mechanism, in the order of the description.
template <class Space, class S>
class ForceElements {
 public:
  ForceElements() = default;
  /// `description` must be valid.
  explicit ForceElements(const MechanismDescription& description) {
    for (const ForceDescription& force : description.forces) {
      std::visit(
          [&]<class Description>(const Description& one) {
            elements_.emplace_back(std::in_place_type<ForceElement<Space, S, Description>>, one,
                                   description);
          },
          force);
    }
  }

  /// Calls visit(element) for each.
  template <class Visit>
  void ForEach(Visit visit) const {
    for (const auto& element : elements_) std::visit(visit, element);
  }

  bool empty() const { return elements_.empty(); }
  /// Returns true if any force has no potential.
  bool has_power() const {
    bool any = false;
    ForEach([&](const auto& element) { any = any || element.has_power(); });
    return any;
  }
  /// Knots of all functions of time [s], ascending, each once.
  std::vector<double> Knots() const {
    std::vector<double> knots;
    ForEach([&](const auto& element) {
      knots.insert(knots.end(), element.knots().begin(), element.knots().end());
    });
    std::ranges::sort(knots);
    knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
    return knots;
  }

 private:
  std::vector<typename AnyForceElement<Space, S>::Type> elements_;
};

}  // namespace loopbench
