#pragma once

#include "bf/model/model.hpp"

#include <functional>
#include <set>

/// Names in MATLAB text, as far as renaming and moving of variables need them.
namespace bf::model {

/// Does it begin with a letter, and have letters, digits and '_' alone?
bool is_identifier(std::string_view name);

/// Calls `visit` with each name of a variable or function in `text`: not with fields, numbers, texts in
/// quotes or comments. What it returns stands in the name's place afterwards. `with_fields`: a name is one
/// with its fields, "a.b". The view is a part of `text`.
std::string replace_names(std::string_view text, const std::function<std::string(std::string_view)>& visit,
                          bool with_fields = false);

/// Calls `visit` with each expression that may use variables: not with texts in MATLAB's quotes nor with
/// code.
void for_each_expression(System& system, const std::function<void(Expression&)>& visit);
void for_each_expression(Variable& variable, const std::function<void(Expression&)>& visit);
/// Those of a block itself: its own settings and sample times, not those of the blocks in it.
void for_each_expression_of_block(Block& block, const std::function<void(Expression&)>& visit);

std::set<std::string> used_names(const Expression& expression);

/// Whether the system declares a variable or an enumeration of that name.
bool declares(const System& system, std::string_view name);

} // namespace bf::model
