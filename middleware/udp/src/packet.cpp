#include "packet.hpp"

#include "bf/realtime/token.hpp"

#include <bit>
#include <boost/hash2/sha2.hpp>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <sys/random.h>
#include <unistd.h>

namespace bf::udp {

static_assert(std::endian::native == std::endian::little, "numbers are sent as they lie in memory");

Key::Key(const std::string& named, bool may_make) {
    const std::string copy = "copy that of the other side";
    const std::string given = realtime::credential(std::filesystem::path(named).filename());
    const std::string& file = given.empty() ? named : given;
    if (!may_make && access(file.c_str(), F_OK) != 0)
        throw std::runtime_error("there is no key file " + file + "; " + copy);
    const auto remedy = may_make ? "remove the file, and one is made" : copy;
    if (const auto wrong = realtime::read_token(file, token_, "key", remedy, !given.empty()); !wrong.empty())
        throw std::runtime_error(wrong);
}

std::array<std::byte, Key::code_bytes> Key::code(std::span<const std::byte> bytes) const {
    boost::hash2::hmac_sha2_256 hash(token_.data(), token_.size());
    hash.update(bytes.data(), bytes.size());
    const auto digest = hash.result();
    std::array<std::byte, code_bytes> code;
    std::memcpy(code.data(), digest.data(), code.size());
    return code;
}

void Key::seal(const Head& head, std::span<const std::byte> content, std::vector<std::byte>& datagram) const {
    const std::size_t signed_bytes = head_bytes + content.size();
    datagram.resize(signed_bytes + code_bytes);
    const std::uint32_t kind = static_cast<std::uint32_t>(head.kind);
    std::memcpy(datagram.data(), &Head::magic, 4);
    std::memcpy(datagram.data() + 4, &kind, 4);
    std::memcpy(datagram.data() + 8, &head.session, 8);
    std::memcpy(datagram.data() + 16, &head.sequence, 8);
    std::memcpy(datagram.data() + 24, &head.number, 8);
    if (!content.empty()) std::memcpy(datagram.data() + head_bytes, content.data(), content.size());
    const auto its = code({datagram.data(), signed_bytes});
    std::memcpy(datagram.data() + signed_bytes, its.data(), code_bytes);
}

std::span<const std::byte> Key::open(std::span<const std::byte> datagram, Head& head) const {
    head = {};
    std::uint32_t magic = 0, kind = 0;
    if (datagram.size() < head_bytes + code_bytes) return {};
    std::memcpy(&magic, datagram.data(), 4);
    if (magic != Head::magic) return {};
    const auto signed_part = datagram.first(datagram.size() - code_bytes);
    const auto its = code(signed_part);
    // How long that takes does not tell how much of it is right.
    std::byte difference{};
    for (std::size_t i = 0; i < code_bytes; ++i) difference |= its[i] ^ datagram[signed_part.size() + i];
    if (difference != std::byte{}) return {};
    std::memcpy(&kind, datagram.data() + 4, 4);
    if (kind == 0 || kind > static_cast<std::uint32_t>(Kind::news)) return {};
    head.kind = static_cast<Kind>(kind);
    std::memcpy(&head.session, datagram.data() + 8, 8);
    std::memcpy(&head.sequence, datagram.data() + 16, 8);
    std::memcpy(&head.number, datagram.data() + 24, 8);
    return signed_part.subspan(head_bytes);
}

std::uint64_t Key::number_of(std::span<const std::byte> bytes) const {
    std::uint64_t number = 0;
    const auto its = code(bytes);
    std::memcpy(&number, its.data(), sizeof number);
    return number | 1;
}

bool Key::is_of_other_version(std::span<const std::byte> datagram) {
    return datagram.size() >= head_bytes && std::memcmp(datagram.data(), &Head::magic, 3) == 0 &&
           std::memcmp(datagram.data(), &Head::magic, 4) != 0;
}

bool Arrivals::come(std::uint64_t sequence) {
    if (sequence > newest_) {
        const std::uint64_t ahead = sequence - newest_;
        lost_ += ahead - 1;
        if (ahead < window)
            seen_ <<= ahead;
        else
            seen_.reset();
        seen_[0] = true;
        newest_ = sequence;
    } else {
        const std::uint64_t behind = newest_ - sequence;
        if (behind >= window || sequence < first_) {
            ++late_;
            return false;
        }
        if (seen_[behind]) {
            ++duplicates_;
            return false;
        }
        seen_[behind] = true;
        ++late_;
        --lost_;
    }
    ++received_;
    return true;
}

std::uint64_t random_number() {
    std::uint64_t number = 0;
    if (getrandom(&number, sizeof number, 0) != sizeof number)
        throw std::runtime_error("the system gives no random numbers");
    return number | 1;
}

bool copy(std::span<const std::byte> content, std::vector<double>& values) {
    if (content.size() != values.size() * sizeof(double)) return false;
    if (!values.empty()) std::memcpy(values.data(), content.data(), content.size());
    return true;
}

} // namespace bf::udp
