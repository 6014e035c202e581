// Whether this build has a sanitizer that needs terabytes of address space and a few system calls
// more.
#ifndef VANTAGE_CORE_CONFINEMENT_SANITIZED_H_
#define VANTAGE_CORE_CONFINEMENT_SANITIZED_H_

namespace vantage::confinement {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace vantage::confinement

#endif  // VANTAGE_CORE_CONFINEMENT_SANITIZED_H_
