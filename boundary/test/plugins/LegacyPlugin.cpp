#include "LegacyPlugin.hpp"

#include <stdexcept>

namespace legacy_test {

using namespace blockfactory::core;

const unsigned Accumulate::NumberOfParameters = Block::NumberOfParameters + 2;

bool Accumulate::parseParameters(BlockInformation* blockInfo) {
    const int open = ParameterMetadata::DynamicSize;
    return blockInfo->addParameterMetadata({ParameterType::DOUBLE, 2, 1, 1, "factor"}) &&
           blockInfo->addParameterMetadata({ParameterType::DOUBLE, 3, 1, open, "bias"}) &&
           blockInfo->parseParameters(m_parameters);
}

bool Accumulate::configureSizeAndPorts(BlockInformation* blockInfo) {
    // As other people's code spells it, through the name that a class has inside itself.
    const auto type = Port::Port::DataType::DOUBLE;
    return Block::initialize(blockInfo) &&
           blockInfo->setPortsInfo({{0, {Port::DynamicSize}, type}, {1, {Port::DynamicSize}, type}},
                                   {{0, {Port::DynamicSize}, type}});
}

bool Accumulate::initialize(BlockInformation* blockInfo) {
    if (!Block::initialize(blockInfo) || !parseParameters(blockInfo) ||
        !m_parameters.getParameter("factor", factor_) || !m_parameters.getParameter("bias", offset_))
        return false;
    const int widths[] = {blockInfo->getInputPortWidth(0), blockInfo->getInputPortWidth(1)};
    if (widths[0] == widths[1] && widths[0] == static_cast<int>(offset_.size())) return true;
    bfError << "The inputs have " << widths[0] << " and " << widths[1] << " elements, the offset has "
            << offset_.size();
    return false;
}

bool Accumulate::initializeInitialConditions(const BlockInformation*) {
    steps_ = 0;
    return true;
}

bool Accumulate::output(const BlockInformation* blockInfo) {
    InputSignalPtr u1 = blockInfo->getInputPortSignal(0);
    InputSignalPtr u2 = blockInfo->getInputPortSignal(1);
    OutputSignalPtr y = blockInfo->getOutputPortSignal(0);
    if (!u1 || !u2 || !y) return false;
    for (unsigned i = 0; i < u1->getWidth(); ++i)
        if (!y->set(i, factor_ * (u1->get<double>(i) + u2->get<double>(i)) + offset_[i] + steps_))
            return false;
    return true;
}

bool Accumulate::updateDiscreteState(const BlockInformation*) {
    ++steps_;
    return true;
}

bool AllParameters::parseParameters(BlockInformation* blockInfo) {
    for (const auto& md :
         {ParameterMetadata(ParameterType::INT, 2, 1, 1, "period"),
          ParameterMetadata(ParameterType::BOOL, 3, 1, 1, "flag"),
          ParameterMetadata(ParameterType::DOUBLE, 4, 1, 1, "real"),
          ParameterMetadata(ParameterType::STRING, 5, 1, 1, "text"),
          ParameterMetadata(ParameterType::INT, 6, 1, 3, "three"),
          ParameterMetadata(ParameterType::CELL_STRING, 7, 1, ParameterMetadata::DynamicSize, "cells"),
          ParameterMetadata(ParameterType::STRUCT_DOUBLE, 8, 1, 1, "field")})
        if (!blockInfo->addParameterMetadata(md)) return false;
    return blockInfo->parseParameters(m_parameters);
}

bool AllParameters::configureSizeAndPorts(BlockInformation* blockInfo) {
    return Block::parseParameters(blockInfo) &&
           blockInfo->setPortsInfo({}, {{0, {9}, Port::DataType::DOUBLE}});
}

bool AllParameters::initialize(BlockInformation* blockInfo) {
    int whole = 0;
    bool flag = false;
    double real = 0, field = 0;
    std::string text;
    std::vector<int> three;
    std::vector<std::string> cells;
    if (!Block::initialize(blockInfo) || !parseParameters(blockInfo) ||
        !m_parameters.getParameter("period", whole) || !m_parameters.getParameter("flag", flag) ||
        !m_parameters.getParameter("real", real) || !m_parameters.getParameter("text", text) ||
        !m_parameters.getParameter("three", three) || !m_parameters.getParameter("cells", cells) ||
        !m_parameters.getParameter("field", field))
        return false;
    told_ = {double(whole), flag ? 1.0 : 0.0, real, double(text.size())};
    told_.insert(told_.end(), three.begin(), three.end());
    told_.push_back(double(cells.size()));
    told_.push_back(field);
    return true;
}

bool AllParameters::output(const BlockInformation* blockInfo) {
    return blockInfo->getOutputPortSignal(0)->setBuffer(told_.data(), told_.size());
}

bool Matrices::configureSizeAndPorts(BlockInformation* blockInfo) {
    return Block::configureSizeAndPorts(blockInfo) &&
           blockInfo->setPortsInfo({{0, {2, 3}, Port::DataType::SINGLE}},
                                   {{0, {2, 3}, Port::DataType::SINGLE}});
}

bool Matrices::output(const BlockInformation* blockInfo) {
    const float* u = blockInfo->getInputPortSignal(0)->getBuffer<float>();
    float* y = blockInfo->getOutputPortSignal(0)->getBuffer<float>();
    const Port::Size::Matrix size = blockInfo->getInputPortMatrixSize(0);
    if (!u || !y) return false;
    for (int i = 0; i < size.rows * size.cols; ++i) y[i] = 2 * u[i];
    return true;
}

const unsigned Labelled::NumberOfParameters = Block::NumberOfParameters + 2;

bool Labelled::parseParameters(BlockInformation* blockInfo) {
    return blockInfo->addParameterMetadata({ParameterType::STRUCT_DOUBLE, 2, 1, 1, "gain"}) &&
           blockInfo->addParameterMetadata({ParameterType::STRUCT_STRING, 2, 1, 1, "unit"}) &&
           blockInfo->addParameterMetadata({ParameterType::STRING, 3, 1, 1, "label"}) &&
           blockInfo->parseParameters(m_parameters);
}
bool Labelled::configureSizeAndPorts(BlockInformation* blockInfo) {
    return Block::configureSizeAndPorts(blockInfo) && Labelled::parseParameters(blockInfo);
}
bool Labelled::initialize(BlockInformation* blockInfo) {
    std::string label;
    if (!Block::initialize(blockInfo) || !Labelled::parseParameters(blockInfo) ||
        !m_parameters.getParameter("gain", gain_) || !m_parameters.getParameter("label", label))
        return false;
    offset_ = static_cast<double>(label.size());
    return true;
}
bool Labelled::output(const BlockInformation* blockInfo) {
    return blockInfo->getOutputPortSignal(0)->set(
        0, gain_ * blockInfo->getInputPortSignal(0)->get<double>(0) + offset_);
}

bool Offset::parseParameters(BlockInformation* blockInfo) {
    double gain = 0;
    return blockInfo->addParameterMetadata({ParameterType::DOUBLE, 4, 1, 1, "shift"}) &&
           blockInfo->parseParameters(m_parameters) && m_parameters.getParameter("gain", gain);
}
bool Offset::configureSizeAndPorts(BlockInformation* blockInfo) {
    return Labelled::configureSizeAndPorts(blockInfo) && parseParameters(blockInfo) &&
           blockInfo->setPortsInfo({{0, {1}, Port::DataType::DOUBLE}}, {{0, {1}, Port::DataType::DOUBLE}});
}
bool Offset::initialize(BlockInformation* blockInfo) {
    double offset = 0;
    if (!Labelled::initialize(blockInfo) || !parseParameters(blockInfo) ||
        !m_parameters.getParameter("shift", offset))
        return false;
    offset_ += offset;
    return true;
}

bool LateOffset::configureSizeAndPorts(BlockInformation* blockInfo) {
    return blockInfo->setPortsInfo({{0, {1}, Port::DataType::DOUBLE}}, {{0, {1}, Port::DataType::DOUBLE}});
}
Misbehaves::Misbehaves() = default;

bool Misbehaves::outcome(const std::string& call) const {
    if (misdeed_ == call + " throws") throw std::runtime_error("thrown on purpose {0}");
    if (misdeed_ == call + " throws 7") throw 7;
    if (misdeed_ != call + " returns false") return true;
    bfError << "refused on purpose";
    return false;
}

/// A message whose text asks for what logs a message of its own.
bool Misbehaves::log_in_a_log() const {
    bfError << "parameter 7 is called '" << m_parameters.getParamName(7) << "', which is wrong";
    return false;
}

bool Misbehaves::parseParameters(BlockInformation* blockInfo) {
    if (!blockInfo->addParameterMetadata({ParameterType::STRING, 2, 1, 1, "misdeed"}) ||
        !blockInfo->parseParameters(m_parameters) || !m_parameters.getParameter("misdeed", misdeed_))
        return false;
    if (misdeed_ == "wrong type") {
        int number = 0;
        if (!m_parameters.getParameter("misdeed", number)) return false;
    }
    return outcome("parseParameters");
}

bool Misbehaves::configureSizeAndPorts(BlockInformation* blockInfo) {
    if (!Block::configureSizeAndPorts(blockInfo) || !parseParameters(blockInfo)) return false;
    if (misdeed_ == "signal too early" && !blockInfo->getInputPortSignal(0)) return false;
    const InputPortsInfo inputs{{0, {3}, Port::DataType::DOUBLE}};
    const OutputPortsInfo twice{{0, {3}, Port::DataType::DOUBLE}, {0, {3}, Port::DataType::DOUBLE}};
    if (misdeed_ == "port index twice") return blockInfo->setPortsInfo(inputs, twice);
    if (!blockInfo->setPortsInfo(inputs, {{0, {3}, Port::DataType::DOUBLE}})) return false;
    if (misdeed_ == "ports twice" && !blockInfo->setPortsInfo(inputs, {})) return false;
    return outcome("configureSizeAndPorts");
}

bool Misbehaves::initialize(BlockInformation* blockInfo) {
    if (!Block::initialize(blockInfo) || !parseParameters(blockInfo)) return false;
    return misdeed_ == "logs in a log" ? log_in_a_log() : outcome("initialize");
}
bool Misbehaves::initializeInitialConditions(const BlockInformation*) {
    return outcome("initializeInitialConditions");
}
bool Misbehaves::output(const BlockInformation* blockInfo) {
    const std::vector<double> ones(4, 1.0);
    if (misdeed_ == "shrinks") return blockInfo->getOutputPortSignal(0)->setBuffer(ones.data(), 2);
    if (misdeed_ == "grows") return blockInfo->getOutputPortSignal(0)->setBuffer(ones.data(), 4);
    return outcome("output") && blockInfo->getOutputPortSignal(0)->setBuffer(ones.data(), 3);
}
bool Misbehaves::updateDiscreteState(const BlockInformation*) { return outcome("updateDiscreteState"); }
bool Misbehaves::terminate(const BlockInformation*) { return outcome("terminate"); }

bool Nothing::configureSizeAndPorts(BlockInformation* blockInfo) {
    return Block::configureSizeAndPorts(blockInfo) &&
           blockInfo->setPortsInfo({{0, {1}, Port::DataType::DOUBLE}}, {{0, {1}, Port::DataType::DOUBLE}});
}
bool Nothing::output(const BlockInformation* blockInfo) {
    return blockInfo->getOutputPortSignal(0)->set(0, blockInfo->getInputPortSignal(0)->get<double>(0));
}

namespace {
std::string diary;
int diaries = 0;
} // namespace

Diary::Diary() : number_(++diaries) { note("create"); }
Diary::~Diary() { note("destroy"); }
bool Diary::note(const char* call) const {
    diary += std::to_string(number_) + " " + call + "\n";
    return true;
}
bool Diary::parseParameters(BlockInformation* blockInfo) {
    return note("parseParameters") && blockInfo->parseParameters(m_parameters);
}
bool Diary::configureSizeAndPorts(BlockInformation* blockInfo) {
    return note("configureSizeAndPorts") && Block::configureSizeAndPorts(blockInfo) &&
           blockInfo->setPortsInfo({{0, {1}, Port::DataType::DOUBLE}}, {{0, {1}, Port::DataType::DOUBLE}});
}
bool Diary::initialize(BlockInformation* blockInfo) {
    return note("initialize") && Block::initialize(blockInfo);
}
bool Diary::initializeInitialConditions(const BlockInformation*) {
    return note("initializeInitialConditions");
}
bool Diary::output(const BlockInformation* blockInfo) {
    return note("output") &&
           blockInfo->getOutputPortSignal(0)->set(0, blockInfo->getInputPortSignal(0)->get<double>(0));
}
bool Diary::updateDiscreteState(const BlockInformation*) { return note("updateDiscreteState"); }
bool Diary::terminate(const BlockInformation*) { return note("terminate"); }

CannotBeMade::CannotBeMade() { throw std::runtime_error("no device"); }

} // namespace legacy_test

/// What happened since it was asked the last time.
extern "C" const char* legacy_diary() {
    static std::string told;
    told.swap(legacy_test::diary);
    legacy_test::diary.clear();
    return told.c_str();
}
