// How tests apply operations.
#pragma once

#include "bf/model/check.hpp"
#include "bf/model/operation.hpp"

#include <gtest/gtest.h>
#include <string>

namespace bf::model {

/// Applies the operation by way of its text, and undoes and repeats it on the way.
inline Model after(const Model& before, const Operation& operation, const ReadReference& read = {}) {
    const Operation read_back = operation_from_json(to_json(operation));
    EXPECT_EQ(to_json(read_back), to_json(operation));
    Model model = before;
    const operations::Patch back = edit(model, read_back, read);
    for (const Diagnostic& wrong : check(model)) ADD_FAILURE() << wrong.text();
    Model undone = model;
    const operations::Patch again = edit(undone, back);
    EXPECT_TRUE(undone == before) << to_json(back);
    EXPECT_EQ(to_json(edit(undone, again)), to_json(back));
    EXPECT_TRUE(undone == model) << to_json(again);
    undone = model;
    edit(undone, operation_from_json(to_json(Operation(back))), read);
    EXPECT_TRUE(undone == before) << to_json(back);
    return model;
}

/// What is said where the operation is impossible; the model is as it was then.
inline std::string refusal(const Operation& operation, Model model) {
    const Model before = model;
    try {
        edit(model, operation);
    } catch (const Errors& errors) {
        EXPECT_TRUE(model == before);
        return errors.what();
    }
    return "accepted";
}

} // namespace bf::model
