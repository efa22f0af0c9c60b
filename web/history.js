// Page of a history: the theme of the system, and the series with all words of the filter.
const dark = matchMedia('(prefers-color-scheme: dark)');
const paint = () => { document.documentElement.dataset.theme = dark.matches ? 'dark' : 'light'; };
paint();
dark.addEventListener('change', paint);
document.addEventListener('DOMContentLoaded', () => {
  const filter = document.getElementById('filter');
  filter.addEventListener('input', () => {
    const words = filter.value.toLowerCase().split(/\s+/);
    for (const one of document.querySelectorAll('figure, tr.series')) {
      const text = one.textContent.toLowerCase();
      one.hidden = !words.every((word) => text.includes(word));
    }
  });
});
