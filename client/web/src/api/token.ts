// Who this tablet is to the server. A link that pairs a tablet carries its token behind '#', which a
// browser never sends to anyone: it is kept on the tablet and taken out of the address.
const stored = "vantage.token";

export function takeTokenFromAddress(): void {
  takeToken();
  // A link that is opened where the page is open already changes only what stands behind '#'.
  window.addEventListener("hashchange", () => {
    if (takeToken()) location.reload();
  });
}

function takeToken(): boolean {
  const match = /[#&]token=([^&]+)/.exec(location.hash);
  if (match?.[1] === undefined) return false;
  localStorage.setItem(stored, decodeURIComponent(match[1]));
  history.replaceState(null, "", location.pathname + location.search);
  return true;
}

export function token(): string | null {
  return localStorage.getItem(stored);
}

export function forgetToken(): void {
  localStorage.removeItem(stored);
}
