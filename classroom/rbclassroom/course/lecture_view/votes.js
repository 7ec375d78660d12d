"use strict";

// V opens the vote on the poll that was reached last, and closes it.
window.vote = (() => {
  const panel = document.querySelector("#lecture-vote").content.firstElementChild;
  let state = { poll: "", open: false, voters: 0, counts: [] };

  const number = () => (state.voters === 1 ? "1 vote" : `${state.voters} votes`);

  const sentence = () => {
    if (!state.poll) return "V opens the vote on a poll.";
    return `${state.poll}: ${number()}${state.open ? "; V closes the vote" : ""}`;
  };

  // The options of a poll are the items of its list that begin with a letter in bold.
  const findOptions = (poll) => {
    const cell = poll?.closest(".jp-Cell");
    return [...(cell?.querySelectorAll("li") ?? [])].filter((item) =>
      /^[A-Z]$/.test(item.querySelector("strong")?.textContent),
    );
  };

  const show = () => {
    const poll = [...document.querySelectorAll("#rendered_cells h3")].find(
      (heading) => heading.innerText.trim() === state.poll,
    );
    if (!poll || !state.open) panel.remove();
    if (!poll) return;
    panel.querySelector("output").textContent = number();
    const cell = poll.closest(".jp-Cell");
    if (state.open && !cell.contains(panel)) cell.prepend(panel);
    findOptions(poll).forEach((option, i) => {
      const count = state.counts[i] ?? 0, share = `${Math.round((100 * count) / (state.voters || 1))}%`;
      option.classList.toggle("lecture-counted", !state.open);
      option.dataset.count = state.open ? "" : `${count} · ${share}`;
      option.style.setProperty("--share", share);
    });
  };

  const ask = async (body) => {
    const settings = body && { method: "POST", body: JSON.stringify(body) };
    const answer = await fetch(`votes${location.search}`, settings).catch(() => null);
    const said = await answer?.json().catch(() => null);
    if (!answer?.ok) return pages.say(`The vote: ${said?.message ?? "Python has ended."}`);
    state = said;
    show();
  };

  // V twice is V once: it would count a vote that nobody had time for.
  let opened = -Infinity;
  const turn = async () => {
    if (state.open && performance.now() - opened < 1000) return;
    if (state.open) return ask({});
    const { poll } = pages.where(true);
    if (!poll) return pages.say("There is no poll on this page.");
    await ask({ poll: poll.innerText.trim(), options: findOptions(poll).length });
    opened = performance.now();
  };

  // One request after the other.
  let last = Promise.resolve();
  const then = (next) => (last = last.then(next));
  const press = () => then(turn);

  const watch = () => then(() => ask()).then(() => setTimeout(watch, 1000));
  watch();
  return { press, sentence };
})();
