#pragma once

#include "legacy_class.hpp"

namespace bf::boundary {

/// What a class of an old plugin tells of itself when it is given these values.
struct LegacyDescription {
    LegacyDescription(const std::shared_ptr<const LegacyClass>& legacy, const Arguments& values);

    /// By index, class and library among them. A subclass may leave its base's parameters to its base, which
    /// declares them where it is configured or initialised. One that the block counts and never declares is
    /// called ParamIndex_<index>.
    std::vector<HostInformation::Metadata> parameters;
    blockfactory::core::Parameters values; ///< of the declared ones
    HostInformation::Ports inputs, outputs;
    std::string problem; ///< which values are missing or refused; else empty
};

} // namespace bf::boundary
