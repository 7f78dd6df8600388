// Whether this program was built with the address sanitizer, which claims terabytes of addresses: limits of memory do
// not go with it.
#pragma once

namespace freevoxel {

inline constexpr bool kUnderAddressSanitizer =
#if defined(__SANITIZE_ADDRESS__)
    true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
    true;
#else
    false;
#endif
#else
    false;
#endif

}  // namespace freevoxel
