// SPDX-License-Identifier: GPL-3.0-or-later
// Makes the elements of the page.

/// Makes an element. properties: of the element, besides `class` and attributes with a dash; children: elements or
/// texts.
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "class") element.className = value;
    else if (name.includes("-") || name === "role") element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

let last = 0;
const new_id = () => `subvol-${++last}`;

/// A labeled control. Each has `show(value)`, which sets it without telling.
function labeled(text, input, output) {
  input.id = new_id();
  const row = make("div", { class: "row" }, make("label", { htmlFor: input.id }, text), input, output);
  return row;
}

export function slider(text, { min, max, step }, change, format = (x) => String(x)) {
  const input = make("input", { type: "range", min, max, step }),
    output = make("output");
  const row = labeled(text, input, output);
  input.addEventListener("input", () => {
    output.textContent = format(Number(input.value));
    change(Number(input.value));
  });
  row.show = (value) => {
    if (document.activeElement !== input || Number(input.value) !== value) input.value = value;
    output.textContent = format(value);
  };
  row.limit = (most) => (input.max = most);
  return row;
}

export function check(text, change) {
  const input = make("input", { type: "checkbox", id: new_id() });
  const row = make("div", { class: "row check" }, input, make("label", { htmlFor: input.id }, text));
  input.addEventListener("change", () => change(input.checked));
  row.show = (value) => (input.checked = value);
  return row;
}

export function choice(text, options, change) {
  const input = make("select"),
    row = labeled(text, input);
  row.fill = (entries) => input.replaceChildren(...entries.map(([value, label]) => make("option", { value }, label)));
  row.fill(options);
  input.addEventListener("change", () => change(input.value));
  row.show = (value) => (input.value = value);
  return row;
}

export function number(text, change) {
  const input = make("input", { type: "number", step: "any" }),
    row = labeled(text, input);
  input.addEventListener("change", () => input.value !== "" && change(Number(input.value)));
  row.show = (value) => document.activeElement !== input && (input.value = Number(value.toPrecision(5)));
  return row;
}

export function button(text, title, press) {
  const element = make("button", { type: "button", title }, text);
  element.addEventListener("click", press);
  return element;
}

export function section(title, open, ...children) {
  return make("details", { open }, make("summary", {}, title), ...children);
}

/// A number for people, in at most five digits.
export function digits(x) {
  if (Number.isNaN(x)) return "–";
  if (Number.isInteger(x) && Math.abs(x) < 1e7) return String(x);
  const text = x.toPrecision(4);
  return Math.abs(x) < 1e-4 || Math.abs(x) >= 1e7 ? Number(text).toExponential() : String(Number(text));
}
