// Functions of the language in the forms that MATLAB's documentation names: how many arguments they take,
// what they refuse, and how much memory they may ask for.
#include "sample.hpp"

#include <gtest/gtest.h>
#include <sstream>

using namespace bf::matlab;

namespace {

std::string text_or_message(const std::string& text, const Limits& limits = {}) {
    const Workspace variables = sample_variables();
    try {
        return evaluated(text, variables, limits).to_text();
    } catch (const Error& error) {
        return error.message();
    }
}

/// Least and most number of inputs; "-": any number. Of the forms in MATLAB's documentation those without
/// options for missing values and for arrays of more than two dimensions.
constexpr const char* arities = R"(
zeros 0 -  ones 0 -  eye 0 3  cell 0 2  Inf 0 3  inf 0 3  NaN 0 3  nan 0 3  true 0 2  false 0 2  pi 0 0
size 1 2  length 1 1  numel 1 1  ndims 1 1  diag 1 2  blkdiag 0 -  repmat 2 3  reshape 2 3  permute 2 2
linspace 2 3  colon 2 3  horzcat 0 -  vertcat 0 -  cat 1 -  flipud 1 1  fliplr 1 1  flip 1 2  circshift 2 3
tril 1 2  triu 1 2  meshgrid 1 2
isequal 2 -  struct 0 -  fieldnames 1 1  isfield 2 2  getfield 2 2  setfield 3 3  rmfield 2 2  class 1 1  isa 2 2
isnumeric 1 1  islogical 1 1  ischar 1 1  isstring 1 1  isfloat 1 1  isreal 1 1  iscell 1 1  iscellstr 1 1
isstruct 1 1  isempty 1 1  isscalar 1 1  isvector 1 1  isrow 1 1  iscolumn 1 1  num2cell 1 1  cell2mat 1 1
cellfun 2 -  arrayfun 2 -  feval 1 -  func2str 1 1  str2func 1 1  error 1 -
round 1 2  isnan 1 1  isinf 1 1  isfinite 1 1  eps 0 1  xor 2 2  double 1 1  single 1 1  logical 1 1  int8 1 1
abs 1 1  sign 1 1  sqrt 1 1  exp 1 1  log 1 1  log10 1 1  log2 1 1  sin 1 1  cos 1 1  tan 1 1  asin 1 1  acos 1 1
atan 1 1  sinh 1 1  cosh 1 1  tanh 1 1  floor 1 1  ceil 1 1  fix 1 1  atan2 2 2  hypot 2 2  mod 2 2  rem 2 2
plus 2 2  minus 2 2  times 2 2  rdivide 2 2  power 2 2  mtimes 2 2  mrdivide 2 2  mldivide 2 2  mpower 2 2
eq 2 2  ne 2 2  lt 2 2  le 2 2  gt 2 2  ge 2 2  and 2 2  or 2 2  not 1 1  uminus 1 1  uplus 1 1  transpose 1 1
norm 1 2  inv 1 1  pinv 1 2  det 1 1  trace 1 1  rank 1 2  cond 1 1  svd 1 1  eig 1 1  chol 1 1  dot 2 2
cross 2 2  kron 2 2
sum 1 2  prod 1 2  mean 1 2  var 1 1  std 1 1  any 1 2  all 1 2  nnz 1 1  cumsum 1 2  cumprod 1 2  diff 1 1
min 1 3  max 1 3  find 1 3  sort 1 3  unique 1 1  ismember 2 2
num2str 1 2  int2str 1 1  mat2str 1 2  str2double 1 1  str2num 1 1  sprintf 1 -  strcmp 2 2  strcmpi 2 2
strncmp 3 3  strncmpi 3 3  strcat 1 -  char 1 -  string 1 1  lower 1 1  upper 1 1  strtrim 1 1  strrep 3 3
strsplit 1 2  strjoin 1 2  strfind 2 2  bin2dec 1 1  fullfile 1 -  fileparts 1 1
)";

std::string call_with(const std::string& name, int arguments) {
    std::string text = name + "(";
    for (int i = 0; i < arguments; ++i) text += i > 0 ? ", 1" : "1";
    return text + ")";
}

TEST(Functions, TakeAsManyInputsAsTheirDocumentationSays) {
    std::istringstream table(arities);
    std::string name, most;
    for (int least = 0; table >> name >> least >> most;) {
        std::string wanted = most == "-"                     ? "at least " + std::to_string(least)
                             : std::to_string(least) == most ? most
                                                             : std::to_string(least) + " to " + most;
        wanted = "'" + name + "' takes " + wanted + (wanted == "1" ? " argument" : " arguments") + ", got ";
        const auto refused = [&](int count) {
            return text_or_message(call_with(name, count)) == wanted + std::to_string(count);
        };
        EXPECT_FALSE(refused(least)) << name;
        if (least > 0) {
            EXPECT_TRUE(refused(least - 1)) << name << ": " << text_or_message(call_with(name, least - 1));
        }
        if (most == "-") continue;
        EXPECT_FALSE(refused(std::stoi(most))) << name;
        EXPECT_TRUE(refused(std::stoi(most) + 1))
            << name << ": " << text_or_message(call_with(name, std::stoi(most) + 1));
    }
}

TEST(Functions, AskNoMoreMemoryThanIsAllowed) {
    constexpr std::pair<const char*, const char*> large[] = {
        {"zeros(11)", "11x11"},
        {"ones(2, 51)", "2x51"},
        {"eye(11)", "11x11"},
        {"cell(11)", "11x11"},
        {"diag(1:11)", "11x11"},
        {"diag(1:10, 1)", "11x11"},
        {"repmat([1 2 3], 3, 12)", "3x36"},
        {"linspace(0, 1, 101)", "1x101"},
        {"kron(1:11, 1:11)", "1x121"},
        {"meshgrid(1:11, 1:11)", "11x11"},
        {"1:101", "1x101"},
        {"(1:51)' * (1:2)", "51x2"},
        {"(1:11)' + (1:11)", "11x11"},
        {"[1:51, 1:50]", "1x101"},
        {"[(1:51)'; (1:50)']", "101x1"},
    };
    for (const auto& [text, size] : large)
        EXPECT_EQ(text_or_message(text, {.elements = 100}),
                  "an array of " + std::string(size) + " exceeds the limit of 100 elements")
            << text;
    for (const char* text :
         {"numel(zeros(10))", "numel(linspace(0, 1, 100))", "numel(1:100)", "numel(repmat(1, 10, 10))",
          "numel(kron(1:10, 1:10))", "numel(diag(1:10))", "numel([1:50, 1:50])", "numel((1:10)' + (1:10))"})
        EXPECT_EQ(text_or_message(text, {.elements = 100}), "100") << text;
}

/// By hand, from the definitions in MATLAB's documentation.
constexpr std::pair<const char*, const char*> forms[] = {
    // norm
    {"norm([1 2; 3 4], 1)", "6"},
    {"norm([1 -2; 3 4], Inf)", "7"},
    {"norm([1 -2; 3 4], 'inf')", "7"},
    {"norm([1 -2; 3 4], 'Inf')", "7"},
    {"norm([3 0; 0 -4])", "4"},
    {"norm([1 1; 1 1], 'fro')", "2"},
    {"norm([3 -4 0], -Inf)", "0"},
    {"norm([1 2 2], 'fro')", "3"},
    {"norm([1 1 1 1 1 1 1 1], 3)", "2"},
    {"norm([])", "0"},
    {"norm([1 2; 3 4], 3)", "norm(A,p) of a matrix needs p = 1, 2, inf or 'fro', got 3"},
    {"class(norm(single([3 4])))", "'single'"},
    // isequal
    {"isequal([1 2], [1 3])", "false"},
    {"isequal([1 2], [1; 2])", "false"},
    {"isequal(1, 1, 2)", "false"},
    {"isequal(int8(3), 3)", "true"},
    {"isequal({1, 'a'}, {1, 'a'})", "true"},
    {"isequal({1, 'a'}, {1, 'b'})", "false"},
    {"isequal({1}, 1)", "false"},
    {"isequal(1, {1})", "false"},
    {"isequal(struct('a', 1, 'b', 2), struct('b', 2, 'a', 1))", "true"},
    {"isequal(struct('a', 1), struct('a', 2))", "false"},
    {"isequal(struct('a', 1), struct('b', 1))", "false"},
    {"isequal(struct('a', 1), struct('a', 1, 'b', 1))", "false"},
    {"isequal(struct('a', 1), 1)", "false"},
    // text of digits
    {"bin2dec('1011')", "11"},
    {"bin2dec('10 11')", "11"},
    {"bin2dec('102')", "bin2dec needs text of 0 and 1, got '102'"},
    {"bin2dec('1/1')", "bin2dec needs text of 0 and 1, got '1/1'"},
    {"bin2dec('-1')", "bin2dec needs text of 0 and 1, got '-1'"},
    // factorisations
    {"chol([4 2; 2 5])", "[2 1; 0 2]"},
    {"chol([1 2; 2 1])", "chol needs a positive definite matrix"},
    {"chol([])", "[]"},
    {"det([2 0; 0 3])", "6"},
    {"rank([1 2; 2 4])", "1"},
    {"rank(eye(3))", "3"},
    {"trace([1 2; 3 4])", "5"},
    {"eig([2 0; 0 1])", "[1; 2]"},
    {"eig([0 1; -1 0])", "the matrix has complex eigenvalues; complex numbers are not supported"},
    // ranges, of which the second colon ends the step
    {"1:2:3 + 2", "[1 3 5]"},
    {"5:-2:1", "[5 3 1]"},
    {"1:1 + 1:4", "[1 3]"},
    {"1:2 == 1:2", "[true true]"},
    {"1:2:4 == [1 3]", "[true true]"},
    {"colon(1, 2, 5)", "[1 3 5]"},
    {"linspace(1, 2, 3)", "[1 1.5 2]"},
    {"linspace(1, 2, 1)", "2"},
    {"numel(linspace(0, 1))", "100"},
    // shapes
    {"diag([1 2], -1)", "[0 0 0; 1 0 0; 0 2 0]"},
    {"diag([1 2; 3 4])", "[1; 4]"},
    {"diag([1 2; 3 4], 1)", "2"},
    {"tril([1 2; 3 4])", "[1 0; 3 4]"},
    {"tril([1 2; 3 4], -1)", "[0 0; 3 0]"},
    {"triu([1 2; 3 4], 1)", "[0 2; 0 0]"},
    {"circshift([1 2 3], 1)", "[3 1 2]"},
    {"circshift([1 2; 3 4; 5 6], -1)", "[3 4; 5 6; 1 2]"},
    {"circshift([1 2; 3 4], 1, 2)", "[2 1; 4 3]"},
    {"flip([1 2; 3 4])", "[3 4; 1 2]"},
    {"flip([1 2; 3 4], 2)", "[2 1; 4 3]"},
    {"flip([1 2 3])", "[3 2 1]"},
    {"permute([1 2; 3 4], [2 1])", "[1 3; 2 4]"},
    {"permute([1 2; 3 4], [1 2])", "[1 2; 3 4]"},
    {"permute(1, [1 2 3])",
     "permute needs the order [1 2] or [2 1], as there are two dimensions; got [1 2 3]"},
    {"cat(1, [1 2], [3 4])", "[1 2; 3 4]"},
    {"cat(2, [1 2], [3 4])", "[1 2 3 4]"},
    {"blkdiag([1 2], 3)", "[1 2 0; 0 0 3]"},
    {"meshgrid(1, {2})", "expected numbers, got a cell"},
    {"kron([1 2], [1; 3])", "[1 2; 3 6]"},
    // reductions
    {"sum([1 2; 3 4])", "[4 6]"},
    {"sum([1 2; 3 4], 2)", "[3; 7]"},
    {"mean([1 2; 3 6], 2)", "[1.5; 4.5]"},
    {"var([2 4 4 4 5 5 7 9]) * 7", "32"},
    {"cumsum([1 2; 3 4], 2)", "[1 3; 3 7]"},
    {"cumprod([1 2 3 4])", "[1 2 6 24]"},
    {"diff([1 4 9])", "[3 5]"},
    {"diff([1 2; 4 8])", "[3 6]"},
    {"any([0 0; 0 1])", "[false true]"},
    {"all([1 0; 1 1], 2)", "[false; true]"},
    {"max([1 5 3])", "5"},
    {"max([1 5; 7 2], [], 2)", "[5; 7]"},
    {"min([4 2; 1 3])", "[1 2]"},
    {"max([1 5 3], 2)", "[2 5 3]"},
    {"sort([3 1 2], 'descend')", "[3 2 1]"},
    {"sort([3 1; 2 4], 2)", "[1 3; 2 4]"},
    {"find([0 1 0 1])", "[2 4]"},
    {"find([0 1 0 1], 1)", "2"},
    {"unique([3 1 3 2])", "[1 2 3]"},
    {"ismember(2, [1 2])", "true"},
    {"ismember([1 4], [1 2])", "[true false]"},
    {"ismember('b', {'a', 'b'})", "true"},
};

TEST(Functions, HaveTheirDocumentedForms) {
    for (const auto& [text, value] : forms) EXPECT_EQ(text_or_message(text), value) << "of " << text;
}

} // namespace
