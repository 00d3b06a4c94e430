// Creates DOM elements. Names from the scene enter as text nodes only, never as markup.

/// element('button', {class: 'x', onclick: f}, 'text', child ...)
export function element(tag, attributes = {}, ...children) {
  const out = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) out[name] = value;
    else if (value === true) out.setAttribute(name, '');
    else if (value !== false && value !== undefined) out.setAttribute(name, value);
  }
  out.append(...children);
  return out;
}

/// Formats a number with four digits.
export function text(value) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(2).replace('e+', 'e');
  return String(Number(value.toPrecision(4)));
}

/// Offers bytes to the user as a file to save.
export function save(name, bytes) {
  const link = element('a', {download: name, href: URL.createObjectURL(new Blob([bytes]))});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
