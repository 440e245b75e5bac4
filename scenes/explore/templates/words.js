// Text and numbers in the page's language: `words` of the page has its translations, English none.
(() => {
  "use strict";
  const language = document.documentElement.lang, locale = language === "en" ? "en-GB" : language;
  const words = JSON.parse(document.getElementById("words").textContent);
  const plural = new Intl.PluralRules(locale);
  const filled = (text, values) => text.replace(/\{(\w+)\}/g, (_, name) => values[name]);

  // A message, its fields in braces filled
  cfs.gettext = (message, values = {}) => filled(words[message] || message, values);
  // A message on a counted thing; {count} is the number
  cfs.ngettext = (one, many, count, values = {}) => {
    const forms = words[one] || [one, many];
    return filled(forms[plural.select(count) === "one" ? 0 : 1], { ...values, count });
  };
  // A number with the decimal mark of the language
  cfs.fixed = (value, digits) => {
    const text = value.toFixed(digits).replace("-", "−");
    return language === "en" ? text : text.replace(".", ",");
  };
  cfs.day = (date, month) => date.toLocaleDateString(locale, { day: "numeric", month, timeZone: "UTC" });
  cfs.month = (date) => date.toLocaleDateString(locale, { month: "short", timeZone: "UTC" });
})();
