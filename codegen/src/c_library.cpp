#include "c_library.hpp"

#include "bf/kernels/continuous.hpp"
#include "bf/kernels/convert.hpp"
#include "bf/kernels/logic.hpp"
#include "bf/kernels/lookup.hpp"
#include "bf/kernels/overflow.hpp"
#include "bf/kernels/random.hpp"
#include "bf/kernels/svd.hpp"
#include "names.hpp"
#include "symbol.hpp"

#include <algorithm>
#include <array>

namespace bf::codegen {

namespace {

namespace k = kernels;

/// The lines of one kernel, for each element of its first operand.
class Library {
  public:
    Library(const std::vector<Argument>& arguments, const std::string& prefix)
        : arguments_(arguments), prefix_(prefix), type_(arguments[0].type) {}

    /// Of a real number, which the block makes of any other first.
    std::optional<CRule> convert() {
        const Type from = arguments_[2].type;
        if (is_whole(from)) return {};
        const auto rounding = static_cast<k::Rounding>(static_cast<int>(arguments_[1].values[0]));
        const auto overflow = static_cast<k::Overflow>(static_cast<int>(arguments_[1].values[1]));
        constexpr std::array names{"fix", "to_nearest", "floor", "ceil", "round", "to_even"};
        failure_ = k::Convert::failure;
        const std::string way = names[static_cast<std::size_t>(rounding)];
        return each([&](const auto& at) -> Lines {
            const std::string x = at(2), y = at(0);
            const auto whole = [&] { return call({way, Type::float64}, "(double)" + x); };
            Lines lines;
            if (overflow == k::Overflow::error) {
                if (!is_whole(type_))
                    lines = {"if (!(fabs((double)" + x + ") <= (double)" +
                             (type_ == Type::float32 ? "FLT_MAX" : "DBL_MAX") + ")) {"};
                else if (type_ == Type::boolean)
                    lines = {"if (isfinite(" + x + ") == 0) {"};
                else
                    lines = {"if (!" + call({"holds", type_}, whole()) + ") {"};
                lines.push_back("    " + std::string(c_fail));
                lines.push_back("}");
            }
            if (type_ == from)
                lines.push_back(y + " = " + x + ";");
            else if (type_ == Type::boolean)
                lines.push_back(y + " = (" + x + " != " + c_literal(0, from) + ");");
            else if (!is_whole(type_))
                lines.push_back(y + " = (" + c_name(type_) + ")" + x + ";");
            else
                lines.push_back(
                    y + " = " +
                    call({overflow == k::Overflow::saturate ? "saturated" : "wrapped", type_}, whole()) +
                    ";");
            return lines;
        });
    }

    std::optional<CRule> bits(const std::string& function) {
        if (!have_its_type(1)) return {};
        return each([&](const auto& at) -> Lines {
            std::string list = at(1);
            for (int a = 2; a < static_cast<int>(arguments_.size()); ++a) list += ", " + at(a);
            return {at(0) + " = " + call({function, type_}, list) + ";"};
        });
    }
    /// Of the operands, or of the elements of a single one.
    std::optional<CRule> joined_bits(const std::string& function, bool is_inverted) {
        if (!have_its_type(1)) return {};
        const bool is_over_elements = arguments_.size() == 2;
        const int count =
            is_over_elements ? arguments_[1].size.count() : static_cast<int>(arguments_.size()) - 1;
        return each([&](const auto& at) -> Lines {
            const auto operand = [&](int i) { return is_over_elements ? element(1, number(i)) : at(i + 1); };
            std::string text = operand(0);
            for (int i = 1; i < count; ++i) text = call({function, type_}, text + ", " + operand(i));
            return {at(0) + " = " + (is_inverted ? call({"bit_not", type_}, text) : text) + ";"};
        });
    }

    std::optional<CRule> uniform() {
        if (is_whole(type_)) return {};
        return each([&](const auto& at) -> Lines {
            return {at(0) + " = " + at(1) + " + ((" + at(2) + " - " + at(1) + ") * " +
                    call({"uniform", type_},
                         element(3, "0") + ", " + arguments_[4].text + ", " + index() + ", false") +
                    ");"};
        });
    }
    std::optional<CRule> normal() {
        const Argument& period = arguments_[3];
        if (is_whole(type_)) return {};
        return each([&](const auto& at) -> Lines {
            std::string power = at(2);
            if (period.values.empty())
                power = "(" + at(3) + " > " + c_literal(0, type_) + ") ? (" + power + " / " + at(3) +
                        ") : " + power;
            else if (period.values[0] > 0)
                power += " / " + c_literal(period.values[0], type_);
            return {at(0) + " = " + at(1) + " + " +
                    call({"normal", type_},
                         power + ", " + element(4, "0") + ", " + arguments_[5].text + ", " + index()) +
                    ";"};
        });
    }
    std::optional<CRule> next_draw() {
        const std::string &next = arguments_[0].text, &count = arguments_[1].text;
        return CRule{{"{",
                      "    const uint64_t draws = (((uint64_t)" + count + "[1] << 32U) | (uint64_t)" + count +
                          "[0]) + 1ULL;",
                      "    " + next + "[0] = (uint32_t)(draws & 0xFFFFFFFFULL);",
                      "    " + next + "[1] = (uint32_t)(draws >> 32U);", "}"},
                     {},
                     {}};
    }

    std::optional<CRule> look_up(int list_size) {
        const Type type = arguments_[1].type;
        for (int a = 0; a < 3 + list_size; ++a)
            if (arguments_[static_cast<std::size_t>(a)].type != type) return {};
        if (is_whole(type_)) return {};
        const std::string real = c_name(type_), dimensions = number(list_size);
        return inside(
            {constant("layout", type_, arguments_[1].values)}, each([&](const auto& at) -> Lines {
                std::string places;
                for (int i = 0; i < list_size; ++i) places += (i ? ", " : "") + at(3 + i);
                return {"const " + real + " at[" + dimensions + "] = {" + places + "};",
                        at(0) + " = " +
                            call({"look_up", type_}, "layout, " + address(2) + ", at, " + dimensions) + ";"};
            }));
    }

    std::optional<CRule> prelookup() {
        const Argument &points = arguments_[3], &u = arguments_[4];
        if (arguments_[1].type != points.type || is_whole(points.type)) return {};
        const std::string part = arguments_[1].is_array ? "&" + element(1, "i") : "&" + arguments_[1].text;
        return inside({constant("points", points.type, points.values)}, each([&](const auto& at) -> Lines {
                          const std::string k =
                              call({"piece", points.type},
                                   "points, " + number(points.size.count()) + ", " +
                                       cast(at(4), u.type, points.type) + ", " +
                                       (arguments_[2].values[0] != 0 ? "true" : "false") + ", " + part);
                          return {at(0) + " = " + cast(k, Type::int32, type_) + ";"};
                      }));
    }

    std::optional<CRule> interpolate(int list_size) {
        const Argument& sizes = arguments_[1];
        for (const auto& a : arguments_)
            if (a.type != sizes.type || is_whole(a.type)) return {};
        failure_ = k::InterpolateAt::failure;
        const std::string real = c_name(type_), dimensions = number(list_size / 2);
        return inside(
            {constant("sizes", Type::int32, sizes.values)}, each([&](const auto& at) -> Lines {
                std::string places, parts;
                Lines lines;
                for (int i = 0; i < list_size / 2; ++i) {
                    const double n = sizes.values[static_cast<std::size_t>(i)];
                    const std::string place = at(3 + 2 * i);
                    places += (i ? ", (int32_t)" : "(int32_t)") + place;
                    parts += (i ? ", " : "") + at(4 + 2 * i);
                    lines.insert(lines.end(), {"if (!" +
                                                   call({"is_index", Type::int32},
                                                        "(double)" + place + ", " +
                                                            number(n > 1 ? static_cast<int>(n) - 1 : 1)) +
                                                   ") {",
                                               "    " + std::string(c_fail), "}"});
                }
                lines.insert(
                    lines.end(),
                    {"const int32_t places[" + dimensions + "] = {" + places + "};",
                     "const " + real + " part[" + dimensions + "] = {" + parts + "};",
                     at(0) + " = " +
                         call({"weigh", type_}, address(2) + ", sizes, places, part, " + dimensions) + ";"});
                return lines;
            }));
    }

    std::optional<CRule> element_at(int list_size) {
        const Argument &options = arguments_[1], &table = arguments_[2];
        if (table.type != type_) return {};
        failure_ = k::ElementAt::failure;
        return inside(
            {}, each([&](const auto& at) -> Lines {
                Lines lines;
                std::string place;
                const bool stops = options.values[0] != 0;
                for (int i = 0; i < list_size && (stops || table.is_array); ++i) {
                    const std::string index = "at" + number(i + 1);
                    const int n = list_size == 1 ? table.size.count()
                                  : i == 0       ? table.size.rows
                                                 : table.size.cols;
                    lines.push_back(
                        "const double " + index + " = trunc(" +
                        cast(at(3 + i), arguments_[static_cast<std::size_t>(3 + i)].type, Type::float64) +
                        ")" + (options.values[1] != 0 ? "" : " - 1.0") + ";");
                    if (stops)
                        lines.insert(
                            lines.end(),
                            {"if (!" + call({"is_index", Type::int32}, index + ", " + number(n)) + ") {",
                             "    " + std::string(c_fail), "}"});
                    if (!table.is_array) continue;
                    const std::string nearest =
                        call({"nearest_index", Type::int32}, index + ", " + number(n));
                    place += i == 0 ? nearest : " + (" + nearest + " * " + number(table.size.rows) + ")";
                }
                lines.push_back(at(0) + " = " +
                                (table.is_array ? table.text + "[" + place + "]" : table.text) + ";");
                return lines;
            }));
    }

    std::optional<CRule> shift() {
        if (arguments_[2].type != type_) return {};
        return each([&](const auto& at) -> Lines {
            return {at(0) + " = " +
                    call({"shift", type_},
                         at(2) + ", " + cast(element(1, "0"), arguments_[1].type, Type::float64)) +
                    ";"};
        });
    }

    /// Arithmetic that watches the range of its type; stops = [whether the step fails].
    std::optional<CRule> bounded_sum(int list_size) {
        if (!have_its_type(3)) return {};
        failure_ = k::BoundedSum::failure;
        const auto& signs = arguments_[2].values;
        return bounded([&](const auto& at) -> Lines {
            std::string sum = is_whole(type_) ? "" : c_literal(0, type_);
            for (int i = 0; i < list_size; ++i) {
                const bool is_less = signs[signs.size() == 1 ? 0 : static_cast<std::size_t>(i)] < 0;
                sum += sum.empty() ? is_less ? "-" : "" : is_less ? " - " : " + ";
                sum += (is_whole(type_) ? "(int64_t)" : "") + at(3 + i);
            }
            return {at(0) + " = " + call({"bounded", type_}, sum + ", &is_good") + ";"};
        });
    }
    std::optional<CRule> bounded_gain() {
        if (!have_its_type(2)) return {};
        failure_ = k::BoundedGain::failure;
        return bounded([&](const auto& at) -> Lines {
            return {at(0) + " = " + call({"bounded_multiply", type_}, at(2) + ", " + at(3) + ", &is_good") +
                    ";"};
        });
    }
    std::optional<CRule> bounded_product(int list_size) {
        if (!have_its_type(3)) return {};
        failure_ = k::BoundedProduct::failure;
        const auto& exponents = arguments_[2].values;
        return bounded([&](const auto& at) -> Lines {
            Lines lines;
            for (int i = 0; i < list_size; ++i) {
                const bool divides = exponents[exponents.size() == 1 ? 0 : static_cast<std::size_t>(i)] < 0;
                const std::string before = i == 0 ? c_literal(1, type_) : at(0);
                lines.push_back(at(0) + " = " +
                                call({divides ? "bounded_divide" : "bounded_multiply", type_},
                                     before + ", " + at(3 + i) + ", &is_good") +
                                ";");
            }
            return lines;
        });
    }

    std::optional<CRule> slopes(const std::string& function) {
        if (is_whole(type_) || arguments_[1].type != type_) return {};
        const std::string n = number(arguments_[1].size.count());
        Lines declarations{constant("points", type_, arguments_[1].values)};
        std::string operands = address(0) + ", points, " + in_type(2, type_, declarations);
        if (arguments_.size() > 3) operands += ", " + address(3);
        return inside(declarations, CRule{{call({function, type_}, operands + ", " + n) + ";"}, functions_});
    }
    std::optional<CRule> hermite() {
        const Type real = arguments_[2].type;
        if (is_whole(type_) || arguments_[4].type != real) return {};
        Lines declarations{constant("points", real, arguments_[2].values)};
        const std::string table = "points, " + in_type(3, real, declarations) + ", " + address(4) + ", " +
                                  number(arguments_[2].size.count());
        const std::string clips = arguments_[1].values[0] != 0 ? "true, " : "false, ";
        return inside(declarations, each([&](const auto& at) -> Lines {
                          const std::string u = cast(at(5), arguments_[5].type, real);
                          return {at(0) + " = " +
                                  cast(call({"hermite", real}, clips + table + ", " + u), real, type_) + ";"};
                      }));
    }

    std::optional<CRule> delayed_sample() {
        if (!have_its_type(1, 5)) return {};
        failure_ = k::DelayedSample::failure;
        const std::string capacity = number(arguments_[3].size.count());
        const std::string values =
            "&" + arguments_[4].text + "[" + (arguments_[0].size.count() > 1 ? "i * " + capacity : "0") + "]";
        return checked("is_known", true, [&](const auto& at) -> Lines {
            return {at(0) + " = " +
                    call({"delayed", type_}, at(1) + ", " + at(2) + ", " + arguments_[6].text + ", " +
                                                 arguments_[3].text + ", " + values + ", " + capacity +
                                                 "U, " + arguments_[5].text + ", &is_known") +
                    ";"};
        });
    }
    std::optional<CRule> keep_sample() {
        const auto text = [&](std::size_t a) { return arguments_[a].text; };
        const int samples = arguments_[0].size.count(), width = arguments_[7].size.count();
        const std::string capacity = number(samples), newest = "(" + text(5) + " - 1U)",
                          row = width > 1 ? "[(i * " + capacity + ") + (int32_t)row]" : "[row]";
        const auto loop = [](int count, const std::string& line) {
            return count > 1 ? Lines{"for (int i = 0; i < " + number(count) + "; ++i) {", "    " + line, "}"}
                             : Lines{line};
        };
        CRule rule;
        const auto add = [&](const Lines& lines) {
            rule.lines.insert(rule.lines.end(), lines.begin(), lines.end());
        };
        add(loop(samples, text(0) + "[i] = " + text(3) + "[i];"));
        add(loop(samples * width, text(1) + "[i] = " + text(4) + "[i];"));
        add({text(0) + "[row] = " + text(6) + ";"});
        add(loop(width, text(1) + row + " = " + element(7, "i") + ";"));
        add({text(2) + " = sample + 1U;"});
        return inside({"const bool replaces = (" + text(5) + " > 0U) && (" + text(3) + "[" + newest + " % " +
                           capacity + "U] >= " + text(6) + ");",
                       "const uint32_t sample = replaces ? " + newest + " : " + text(5) + ";",
                       "const uint32_t row = sample % " + capacity + "U;"},
                      std::move(rule));
    }

    /// A function of matrices on these operands, which says whether it could do its work.
    std::optional<CRule> matrices(const std::string& function, std::string_view failure,
                                  const std::vector<int>& operands, const std::vector<int>& sizes) {
        std::string list;
        for (const int a : operands) {
            const Argument& its = arguments_[static_cast<std::size_t>(a)];
            const bool is_number = function.ends_with("pinv") && a == 1; // damping, tolerance
            if (is_whole(type_) || !its.values.empty() || (!is_number && its.type != type_)) return {};
            list += (list.empty() ? "" : ", ") +
                    (is_number ? cast(element(a, "0"), its.type, type_) : address(a));
        }
        for (const int size : sizes) list += ", " + number(size);
        return CRule{{"if (!" + call({function, type_}, list) + ") {", "    " + std::string(c_fail), "}"},
                     functions_,
                     failure};
    }
    const Size& size(int a) const { return arguments_[static_cast<std::size_t>(a)].size; }

  private:
    using Lines = std::vector<std::string>;

    /// Each element's lines, which make `name` false where something is wrong; then the step fails.
    template <class F> std::optional<CRule> checked(const std::string& name, bool fails, F&& lines_of) {
        std::optional<CRule> rule = each(lines_of);
        const Lines end = fails ? Lines{"if (!" + name + ") {", "    " + std::string(c_fail), "}"}
                                : Lines{"(void)" + name + ";"};
        rule->lines.insert(rule->lines.end(), end.begin(), end.end());
        return inside({"bool " + name + " = true;"}, std::move(rule));
    }
    template <class F> std::optional<CRule> bounded(F&& lines_of) {
        return checked("is_good", arguments_[1].values[0] != 0, lines_of);
    }
    /// The elements of an operand in that type: a copy of them where they have another one.
    std::string in_type(int a, Type type, Lines& declarations) {
        const Argument& its = arguments_[static_cast<std::size_t>(a)];
        if (its.type == type) return address(a);
        const std::string n = number(its.size.count());
        declarations.insert(declarations.end(),
                            {c_name(type) + " values[" + n + "];", "for (int i = 0; i < " + n + "; ++i) {",
                             "    values[i] = " + cast(element(a, "i"), its.type, type) + ";", "}"});
        return "values";
    }
    std::string cast(const std::string& x, Type from, Type to) {
        if (from == to) return x;
        return from == Type::boolean ? call({"number_of", to}, x) : "(" + c_name(to) + ")" + x;
    }
    std::string address(int a) const {
        const Argument& its = arguments_[static_cast<std::size_t>(a)];
        return its.is_array ? its.text : "&" + its.text;
    }
    static std::string constant(const std::string& name, Type type, const std::vector<double>& values) {
        std::string list;
        for (const double value : values) list += (list.empty() ? "" : ", ") + c_literal(value, type);
        return "static const " + c_name(type) + " " + name + "[" + number(static_cast<int>(values.size())) +
               "] = {" + list + "};";
    }
    /// A block of its own, with declarations at its begin.
    static std::optional<CRule> inside(const Lines& declarations, std::optional<CRule> rule) {
        rule->lines.insert(rule->lines.begin(), declarations.begin(), declarations.end());
        for (auto& line : rule->lines) line.insert(0, "    ");
        rule->lines.insert(rule->lines.begin(), "{");
        rule->lines.push_back("}");
        return rule;
    }

    bool have_its_type(int from, int end = -1) const {
        return std::all_of(arguments_.begin() + from, end < 0 ? arguments_.end() : arguments_.begin() + end,
                           [&](const Argument& a) { return a.type == type_; });
    }
    std::string call(const CFunction& function, const std::string& operands) {
        functions_.insert(function);
        return c_name(function, prefix_) + "(" + operands + ")";
    }
    std::string element(int a, const std::string& i) const {
        const Argument& its = arguments_[static_cast<std::size_t>(a)];
        if (!its.values.empty()) return c_literal(its.values[0], its.type);
        return its.is_array ? its.text + "[" + (its.size.count() == 1 ? "0" : i) + "]" : its.text;
    }
    std::string index() const { return arguments_[0].size.count() > 1 ? "(uint32_t)i" : "0U"; }
    template <class F> std::optional<CRule> each(F&& lines_of) {
        const int count = arguments_[0].size.count();
        const Lines lines = lines_of([&](int a) { return element(a, "i"); });
        CRule rule;
        if (count > 1) rule.lines.push_back("for (int i = 0; i < " + number(count) + "; ++i) {");
        for (const auto& line : lines) rule.lines.push_back((count > 1 ? "    " : "") + line);
        if (count > 1) rule.lines.push_back("}");
        rule.functions = functions_;
        rule.failure = failure_;
        return rule;
    }

    const std::vector<Argument>& arguments_;
    const std::string& prefix_;
    const Type type_;
    std::set<CFunction> functions_;
    std::string_view failure_;
};

} // namespace

std::optional<CRule> library_rule(std::string_view kernel, const std::vector<Argument>& arguments,
                                  int list_size, const std::string& prefix) {
    Library library(arguments, prefix);
    if (kernel == k::Convert::name) return library.convert();
    if (kernel == k::BitAnd::name) return library.bits("bit_and");
    if (kernel == k::BitOr::name) return library.bits("bit_or");
    if (kernel == k::BitXor::name) return library.bits("bit_xor");
    if (kernel == k::BitNot::name) return library.bits("bit_not");
    if (kernel == k::BitAndOfList::name) return library.joined_bits("bit_and", false);
    if (kernel == k::BitOrOfList::name) return library.joined_bits("bit_or", false);
    if (kernel == k::BitXorOfList::name) return library.joined_bits("bit_xor", false);
    if (kernel == k::BitNandOfList::name) return library.joined_bits("bit_and", true);
    if (kernel == k::BitNorOfList::name) return library.joined_bits("bit_or", true);
    if (kernel == k::RandomUniform::name) return library.uniform();
    if (kernel == k::RandomNormal::name) return library.normal();
    if (kernel == k::NextDraw::name) return library.next_draw();
    if (kernel == k::Lookup::name) return library.look_up(list_size);
    if (kernel == k::Prelookup::name) return library.prelookup();
    if (kernel == k::InterpolateAt::name) return library.interpolate(list_size);
    if (kernel == k::ElementAt::name) return library.element_at(list_size);
    if (kernel == k::ShiftBits::name) return library.shift();
    if (kernel == k::BoundedSum::name) return library.bounded_sum(list_size);
    if (kernel == k::BoundedGain::name) return library.bounded_gain();
    if (kernel == k::BoundedProduct::name) return library.bounded_product(list_size);
    if (kernel == k::SplineSlopes::name) return library.slopes("spline_slopes");
    if (kernel == k::AkimaSlopes::name) return library.slopes("akima_slopes");
    if (kernel == k::Hermite::name) return library.hermite();
    if (kernel == k::DelayedSample::name) return library.delayed_sample();
    if (kernel == k::KeepSample::name) return library.keep_sample();
    const auto rows = [&](int a) { return library.size(a).rows; };
    const auto cols = [&](int a) { return library.size(a).cols; };
    const auto matrices = [&](auto its, const char* function, const std::vector<int>& operands,
                              const std::vector<int>& sizes) {
        return library.matrices(function, decltype(its)::failure, operands, sizes);
    };
    if (kernel == k::Solve::name) return matrices(k::Solve{}, "solve", {0, 1, 2, 3}, {rows(1), cols(2)});
    if (kernel == k::SolveRight::name)
        return matrices(k::SolveRight{}, "solve_right", {0, 1, 2, 3}, {rows(2), rows(1)});
    if (kernel == k::Inverse::name) return matrices(k::Inverse{}, "inverse", {0, 1, 2}, {rows(1)});
    if (kernel == k::CholeskySolve::name)
        return matrices(k::CholeskySolve{}, "cholesky_solve", {0, 1, 2, 3}, {rows(1), cols(2)});
    if (kernel == k::DampedPinv::name)
        return matrices(k::DampedPinv{}, "damped_pinv", {0, 1, 2, 3}, {rows(2), cols(2)});
    if (kernel == k::TruncatedPinv::name)
        return matrices(k::TruncatedPinv{}, "truncated_pinv", {0, 1, 2, 3}, {rows(2), cols(2)});
    if (kernel == k::LeastSquares::name)
        return matrices(k::LeastSquares{}, "least_squares", {0, 1, 2, 3}, {rows(1), cols(1), cols(2)});
    return {};
}

} // namespace bf::codegen
