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
    panel.remove();
    const poll = [...document.querySelectorAll("#rendered_cells h3")].find(
      (heading) => heading.innerText.trim() === state.poll,
    );
    if (!poll) return;
    panel.querySelector("output").textContent = number();
    if (state.open) poll.closest(".jp-Cell").prepend(panel);
    findOptions(poll).forEach((option, i) => {
      const count = state.counts[i] ?? 0, share = `${Math.round((100 * count) / (state.voters || 1))}%`;
      option.classList.toggle("lecture-counted", !state.open);
      option.dataset.count = state.open ? "" : `${count} · ${share}`;
      option.style.setProperty("--share", share);
    });
  };

  let busy = false;

  const ask = async (body) => {
    if (busy) return;
    busy = true;
    const settings = body && { method: "POST", body: JSON.stringify(body) };
    const answer = await fetch(`votes${location.search}`, settings).catch(() => null);
    busy = false;
    const said = await answer?.json();
    if (!answer?.ok) return pages.say(`The vote: ${said?.message ?? "Python has ended."}`);
    if (JSON.stringify(said) === JSON.stringify(state)) return;
    state = said;
    show();
  };

  const turn = () => {
    const { poll } = pages.where(true);
    if (state.open) ask({});
    else if (!poll) pages.say("There is no poll on this page.");
    else ask({ poll: poll.innerText.trim(), options: findOptions(poll).length });
  };

  setInterval(ask, 1000);
  return { turn, sentence };
})();
