// What wiring, given values and resources have decided about one block: the second half of its description.
#pragma once

#include "bf/core/declaration.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf {

/// A declared quantity, and what is known of it in a diagram. `initial` is the value given there.
struct Slot : SlotDeclaration {
    Size size; ///< valid when size_known
    bool type_known = false, size_known = false;
};

/// Element `first` + i of the vector `to` is element `picked[i]` of the vector `from`, all from 0; none
/// picked: all in their order. Both are indices of slots.
struct SameElements {
    int to, from;
    int first = 0;
    std::vector<int> picked = {};
};

/// Something outside that a block sets, and that another one must not set in the same step.
struct Claim {
    const void* of;   ///< the object that it is part of, which outlives the diagram
    std::string what; ///< as messages call it; with `of` it says whether two claims are of the same
    int input = -1;   ///< slot: the block sets it only where this input is wired
};

/// Begins with what the declaration alone says; the functions of resolve.hpp add to it.
struct Resolution {
    explicit Resolution(const Declaration& declaration);

    std::vector<Slot> slots; ///< one per declared slot
    std::vector<int> dims;   ///< one per Dim; -1: not known
    std::vector<std::optional<Size>> shapes;
    std::vector<std::optional<Type>> types;
    std::vector<SameElements> same_elements; ///< besides those of vectors of one Dim or AnyShape
    std::vector<Claim> claims;
    std::vector<std::shared_ptr<const void>> required, provided; ///< resources; null: not yet

    /// Index of the slot of that name (and role), or -1.
    int find(std::string_view slot_name) const { return declaration_->find(slot_name); }
    int find(std::string_view slot_name, Role role) const { return declaration_->find(slot_name, role); }
    /// "tau[l_knee]", or "tau[4]" where the block gives no names; elements are numbered from 0.
    std::string element_name(int slot, int element) const;
    /// The type of a slot, once its symbol has one.
    std::optional<Type> type_of(int slot) const;
    /// Are all resources that the block requires there? Otherwise its methods must not be asked.
    bool is_bound() const;
    /// The resource of that type that the block provides, once it is made, or null.
    const void* find_provided(std::string_view type) const;
    const Declaration& declaration() const { return *declaration_; }

  private:
    const Declaration* declaration_;
};

} // namespace bf
