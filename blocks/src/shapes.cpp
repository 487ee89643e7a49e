#include "shapes.hpp"

namespace bf::blocks {

std::string label(const Resolution& resolution, int slot) {
    const Slot& s = resolution.slots[static_cast<std::size_t>(slot)];
    return std::string(name(s.role)) + " '" + s.name + "' of size " + s.size.text();
}

void broadcast(const Block& block, Inference& inference, const std::vector<int>& operands, int result) {
    const Resolution& r = block.resolution();
    Size size;
    int from = -1;
    bool all_known = true;
    for (const int operand : operands) {
        const Size* s = inference.size(operand);
        if (!s) {
            all_known = false;
        } else if (s->is_scalar()) {
            if (size.is_scalar() && s->is_matrix) size = *s;
        } else if (from < 0) {
            size = *s;
            from = operand;
        } else if (s->rows == size.rows && s->cols == size.cols) {
            size.is_matrix = size.is_matrix || s->is_matrix;
        } else if (s->count() == size.count() && s->is_matrix != size.is_matrix &&
                   (s->rows == 1 || size.rows == 1)) {
            if (s->is_matrix) size = *s;
        } else {
            inference.refuse(label(r, from) + " and " + label(r, operand) +
                             " cannot be combined element by element; sizes must be equal or scalar");
        }
    }
    if (!all_known && from < 0) return;
    inference.set(result, size);
    for (const int operand : operands)
        if (const Size* s = inference.size(operand); s && s->count() == size.count())
            inference.same_elements({result, operand});
}

void multiply(const Block& block, Inference& inference, int a, int b, int result) {
    const Size *left = inference.size(a), *right = inference.size(b);
    if (!left || !right) return;
    if (left->is_scalar())
        inference.set(result, right->is_scalar() && left->is_matrix ? *left : *right);
    else if (right->is_scalar() && left->cols != 1)
        inference.set(result, *left);
    else if (right->is_scalar())
        inference.set(result, {left->rows, 1, left->is_matrix || right->is_matrix});
    else if (left->cols == right->rows)
        inference.set(result, {left->rows, right->cols, right->is_matrix});
    else
        inference.refuse(label(block.resolution(), a) + " and " + label(block.resolution(), b) +
                         " cannot be multiplied as matrices; the columns of the first must equal the rows of "
                         "the second (a 1-D signal is a column)");
}

const Size* square(const Block& block, Inference& inference, int slot) {
    const Size* s = inference.size(slot);
    if (s && s->rows != s->cols) inference.refuse(label(block.resolution(), slot) + " must be square");
    return s;
}

void check_feedthrough(const Block& block, Inference& inference, const Matrix& D, int u, int y) {
    const Size *in = inference.size(u), *out = inference.size(y);
    if (!in || !out || D.isZero(0) || (D.rows() == out->count() && D.cols() == in->count())) return;
    inference.refuse("argument 'D' is " + std::to_string(D.rows()) + "x" + std::to_string(D.cols()) +
                     ", but " + label(block.resolution(), u) + " and " + label(block.resolution(), y) +
                     " ask for " + std::to_string(out->count()) + "x" + std::to_string(in->count()));
}

void check_initial(const Block& block, Inference& inference, int initial, int signal) {
    const Size *first = inference.size(initial), *s = inference.size(signal);
    if (first && !first->is_scalar() && !s) return inference.set(signal, *first);
    if (first && s && !first->is_scalar() && first->count() != s->count())
        inference.refuse(label(block.resolution(), initial) + " and " + label(block.resolution(), signal) +
                         " differ; give a scalar or as many elements");
}

} // namespace bf::blocks
