// Colours of lines by theme (Okabe and Ito), and of everything else from the style sheet.

const LINES = { light: ["#0072b2", "#d55e00", "#009e73", "#aa4499", "#56b4e9", "#8a6d00"], dark: ["#56b4e9", "#f0a030", "#2fc497", "#e68acb", "#9ad0ff", "#f0e442"] };

export const theme = () => document.documentElement.dataset.theme;
export const lineColour = i => LINES[theme()][i % 6];
export const themeColour = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
